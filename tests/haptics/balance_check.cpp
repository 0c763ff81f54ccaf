#include "tests/haptics/balance_check.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace palpate::test {
namespace {

using Vec = glm::tvec3<long double>;
using Kind = Primitive::Kind;

/// What one primitive can give at a place: along * [low, high] (planes), or a part of the ball of
/// radius s in the space perpendicular to q: that with f . towards >= least.
struct Giver {
  bool flat = false;
  Vec q{0.0L};
  long double strength = 0.0L;
  Vec towards{0.0L};
  long double least = 0.0L;
  Vec force{0.0L};

  Vec nearest(Vec wanted) const {
    if (flat) return q * std::clamp(glm::dot(wanted, q), 0.0L, strength);
    wanted -= q * glm::dot(wanted, q);
    const long double length = glm::length(wanted);
    const Vec in_ball = length > strength ? wanted * (strength / length) : wanted;
    if (towards == Vec(0.0L) || glm::dot(in_ball, towards) >= least) return in_ball;
    Vec side = wanted - towards * glm::dot(wanted, towards);
    const long double widest = std::sqrt(std::max(0.0L, strength * strength - least * least));
    if (const long double wide = glm::length(side); wide > widest) side *= widest / wide;
    return towards * least + side;
  }
};

Vec perpendicular(const Primitive& p, Vec from) {
  if (p.kind == Kind::kPoint) return from;
  const Vec q = glm::normalize(Vec(p.direction));
  return from - q * glm::dot(q, from);
}

long double size(glm::dvec3 v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

/// One sweep: each giver in turn makes the rest as short as it can.
void sweep(std::vector<Giver>& givers, Vec& rest) {
  for (Giver& giver : givers) {
    const Vec others = rest - giver.force;
    giver.force = giver.nearest(-others);
    rest = others + giver.force;
  }
}

/// The same by a gradient method with momentum and restarts, for givers that are nearly parallel.
void accelerate(std::vector<Giver>& givers, Vec& rest, long double enough) {
  const Vec fixed = [&] {
    Vec sum = rest;
    for (const Giver& giver : givers) sum -= giver.force;
    return sum;
  }();
  const long double step = 1.0L / static_cast<long double>(givers.size());
  std::vector<Vec> before(givers.size());
  for (size_t i = 0; i < givers.size(); ++i) before[i] = givers[i].force;
  long double t = 1.0L;
  for (int k = 0; k < 200000 && glm::length(rest) > enough; ++k) {
    const long double t_next = 0.5L * (1.0L + std::sqrt(1.0L + 4.0L * t * t));
    long double momentum = (t - 1.0L) / t_next;
    Vec ahead = fixed;
    for (size_t i = 0; i < givers.size(); ++i)
      ahead += givers[i].force + momentum * (givers[i].force - before[i]);
    long double against = 0.0L;
    Vec sum = fixed;
    for (size_t i = 0; i < givers.size(); ++i) {
      const Vec at = givers[i].force + momentum * (givers[i].force - before[i]);
      const Vec next = givers[i].nearest(at - step * ahead);
      against += glm::dot(ahead, next - givers[i].force);
      before[i] = givers[i].force;
      givers[i].force = next;
      sum += next;
    }
    rest = sum;
    t = against > 0.0L ? 1.0L : t_next;
  }
}

}  // namespace

double residual_n(const PrimitiveSet& primitives, glm::dvec3 probe, double stiffness_n_per_m,
                  glm::dvec3 proxy, double enough_n) {
  if (!std::isfinite(size(proxy)) || std::isnan(proxy.x + proxy.y + proxy.z)) return HUGE_VAL;
  Vec rest = (Vec(probe) - Vec(proxy)) * static_cast<long double>(stiffness_n_per_m);
  glm::dvec3 free = probe;
  for (const Primitive& p : primitives) {
    if (p.kind != Kind::kForce) continue;
    rest += static_cast<long double>(p.strength_n) * Vec(p.direction);
    free += p.strength_n / stiffness_n_per_m * p.direction;
  }
  std::vector<Giver> givers;
  for (const Primitive& p : primitives) {
    if (p.kind == Kind::kForce) continue;
    const long double slack =
        0x1p-48L * std::max({size(proxy), size(p.position), size(probe), size(free), 1e-6L});
    const long double s = p.strength_n;
    Giver giver;
    giver.strength = s;
    giver.flat = p.kind == Kind::kPlane;
    if (p.kind != Kind::kPoint) giver.q = glm::normalize(Vec(p.direction));
    const Vec from = Vec(proxy) - Vec(p.position);
    if (giver.flat) {
      const long double height = glm::dot(from, giver.q);
      if (height > slack) continue;
      if (height < -slack) {
        rest += s * giver.q;
        continue;
      }
    } else if (const Vec offset = perpendicular(p, from); glm::length(offset) > slack) {
      giver.towards = -glm::normalize(offset);
      const long double sine = slack / glm::length(offset);
      giver.least = s * std::sqrt(1.0L - sine * sine);
    }
    givers.push_back(giver);
  }
  for (Giver& giver : givers) {
    giver.force = giver.nearest(Vec(0.0L));
    rest += giver.force;
  }
  for (int k = 0; k < 300 && glm::length(rest) > enough_n; ++k) sweep(givers, rest);
  if (glm::length(rest) > enough_n) accelerate(givers, rest, enough_n);
  return double(glm::length(rest));
}

long double objective_j(const PrimitiveSet& primitives, glm::dvec3 probe, double stiffness_n_per_m,
                        glm::dvec3 x) {
  const Vec spring = Vec(x) - Vec(probe);
  long double sum = 0.5L * stiffness_n_per_m * glm::dot(spring, spring);
  for (const Primitive& p : primitives) {
    const Vec from = Vec(x) - Vec(p.position);
    const long double s = p.strength_n;
    if (p.kind == Kind::kPlane) sum += s * std::max(0.0L, -glm::dot(from, Vec(p.direction)));
    if (p.kind == Kind::kLine || p.kind == Kind::kPoint)
      sum += s * glm::length(perpendicular(p, from));
    if (p.kind == Kind::kForce) sum -= s * glm::dot(Vec(p.direction), Vec(x));
  }
  return sum;
}

glm::dvec3 slow_balance(const PrimitiveSet& primitives, glm::dvec3 probe, double stiffness_n_per_m,
                        int sweeps) {
  const long double k = stiffness_n_per_m;
  std::vector<Vec> moved(size_t(primitives.count()), Vec(0.0L));
  Vec x(probe);
  for (const Primitive& p : primitives)
    if (p.kind == Kind::kForce) x += Vec(p.direction) * (p.strength_n / k);
  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (int i = 0; i < primitives.count(); ++i) {
      const Primitive& p = primitives[i];
      if (p.kind == Kind::kForce) continue;
      const Vec without = x - moved[size_t(i)];
      const Vec from = without - Vec(p.position);
      const long double reach = p.strength_n / k;
      Vec& move = moved[size_t(i)];
      if (p.kind == Kind::kPlane) {
        const Vec q = glm::normalize(Vec(p.direction));
        move = q * std::clamp(-glm::dot(from, q), 0.0L, reach);
      } else {
        const Vec offset = perpendicular(p, from);
        const long double length = glm::length(offset);
        move = length > reach ? -offset * (reach / length) : -offset;
      }
      x = without + move;
    }
  return glm::dvec3(x);
}

}  // namespace palpate::test
