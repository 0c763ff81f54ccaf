#include "module/haptics/proxy/placed_pair.h"

#include <algorithm>

namespace palpate {
namespace {

// A surface whose normal turns by more than this cosine within a piece bends.
constexpr double kSameDirection = 0.9;

bool holds(const Placed& placed, int i, double stiffness) noexcept {
  const Primitive& p = placed.set[i];
  return p.kind == Primitive::Kind::kPlane &&
         glm::dot(placed.pull - p.position, p.direction) < 0.0 &&
         margin_n(placed, i, stiffness) >= 0.0;
}

}  // namespace

double margin_n(const Placed& placed, int i, double stiffness) noexcept {
  const Primitive& p = placed.set[i];
  return p.strength_n + stiffness * std::min(0.0, glm::dot(placed.pull - p.position, p.direction));
}

bool alike(const Placed& a, const Placed& b) noexcept {
  if (a.set.count() != b.set.count()) return false;
  for (int i = 0; i < a.set.count(); ++i)
    if (a.set[i].kind != b.set[i].kind || a.owner[i] != b.owner[i]) return false;
  return true;
}

void mean(const Placed& a, const Placed& b, Placed& out) noexcept {
  out.set.clear();
  out.pull = a.pull;
  for (int i = 0; i < a.set.count(); ++i) {
    const Primitive& q = b.set[i];
    Primitive p = a.set[i];
    p.strength_n = 0.5 * (p.strength_n + q.strength_n);
    p.friction = 0.5 * (p.friction + q.friction);
    // A line has no sense of direction: the nearer of the two is meant.
    const bool turned =
        p.kind == Primitive::Kind::kLine && glm::dot(p.direction, q.direction) < 0.0;
    const glm::dvec3 sum = p.direction + (turned ? -q.direction : q.direction);
    const double length = glm::length(sum);
    if (length > 1e-6) p.direction = sum / length;
    out.set.add(p);
    out.owner[i] = a.owner[i];
  }
}

bool slides(const Placed& here, const Placed& there, int i, double stiffness) noexcept {
  return holds(here, i, stiffness) && holds(there, i, stiffness);
}

bool bends(const Placed& here, const Placed& there, double stiffness) noexcept {
  for (int i = 0; i < here.set.count(); ++i)
    if (slides(here, there, i, stiffness) &&
        glm::dot(here.set[i].direction, there.set[i].direction) < kSameDirection)
      return true;
  return false;
}

glm::dvec3 bent(const Placed& here, const Placed& there, glm::dvec3 straight, glm::dvec3 midway,
                double short_m, double stiffness) noexcept {
  if (here.set.count() != 1 || !slides(here, there, 0, stiffness)) return midway;
  const Primitive &a = here.set[0], &b = there.set[0];
  const glm::dvec3 seen = b.position - a.position, way = midway - a.position;
  const double squared = glm::dot(seen, seen), length = glm::length(way);
  if (!(squared > short_m * short_m) || !(length > 0.0)) return midway;
  const double curvature = glm::dot(b.direction - a.direction, seen) / squared;
  const double depth = glm::dot(a.position - here.pull, a.direction);
  const double stiffer = std::clamp(1.0 - curvature * depth, 0.5, 2.0);
  return a.position + way * (glm::length(straight - a.position) / (stiffer * length));
}

double where_forces_balance(const Placed& here, const Placed& there, glm::dvec3 way,
                            double share) noexcept {
  const double back = -glm::dot(there.pull - here.pull, way) / (share * glm::dot(way, way));
  return back > 0.0 ? 1.0 / (1.0 + back) : 1.0;
}

}  // namespace palpate
