#include "module/haptics/back_track.h"

#include <cmath>
#include <limits>

namespace palpate {
namespace {

constexpr int kNewtonSteps = 16;
// The fixed point gains a factor q a step: what the paper's method needs to be compared at all.
constexpr int kPicardSteps = 64;
constexpr double kToleranceCells = 1e-6;
// How finely a path is searched for folds, and how far: beyond, it counts as folded.
constexpr double kLookCells = 1.0 / 32.0;
constexpr int kMostLooks = 256;

bool finite(glm::dvec3 v) {
  return std::isfinite(v.x + v.y + v.z);
}

/// I + g J.
glm::dmat3 stretched(const MotionSample& at, double phase) {
  glm::dmat3 m = phase * at.jacobian;
  for (int a = 0; a < 3; ++a) m[a][a] += 1.0;
  return m;
}

/// One point of the search: the field there and what is missing.
struct Trial {
  glm::dvec3 x;
  glm::dvec3 miss;
  double residual;
  MotionSample at;
};

class Search {
 public:
  Search(const MotionMap& map, double phase, glm::dvec3 target, glm::dvec3 closing)
      : map_(map), phase_(phase), target_(target), closing_(closing) {}

  Trial look(glm::dvec3 x) const noexcept {
    Trial t{x, glm::dvec3(0.0), 0.0, map_.sample(x)};
    t.miss = x + phase_ * (t.at.u_m + closing_) - target_;
    t.residual = std::sqrt(glm::dot(t.miss, t.miss));
    return t;
  }

  /// Newton's step (I + g J) d = -miss by Cramer's rule. Where the map is folded or all but flat
  /// it would lead to another branch: then the fixed point's step, which only follows the miss.
  glm::dvec3 step(const Trial& t) const noexcept {
    const glm::dmat3 m = stretched(t.at, phase_);
    const glm::dvec3 yz = glm::cross(m[1], m[2]);
    const double det = glm::dot(m[0], yz);
    if (!(det > kFlat)) return -t.miss;
    const glm::dvec3 zx = glm::cross(m[2], m[0]), xy = glm::cross(m[0], m[1]);
    return glm::dvec3(glm::dot(yz, t.miss), glm::dot(zx, t.miss), glm::dot(xy, t.miss)) / -det;
  }

  /// No fold on the straight way from a to b, at the phase: the branch of the motion that was
  /// followed so far has not been left.
  bool unfolded(glm::dvec3 a, glm::dvec3 b, const MotionSample& at_b) const noexcept {
    if (!(glm::determinant(stretched(at_b, phase_)) > 0.0)) return false;
    if (map_.worst_determinant() > 0.0F) return true;
    const double looks = std::ceil(glm::length(b - a) / (kLookCells * map_.cell_m()));
    if (!(looks <= kMostLooks)) return false;
    for (int k = 0; k < int(looks); ++k) {
      const glm::dvec3 x = a + (double(k) / looks) * (b - a);
      if (map_.certificate(x).determinant > 0.0F) continue;
      if (!(glm::determinant(stretched(map_.sample(x), phase_)) > 0.0)) return false;
    }
    return true;
  }

  BackTrack result(const Trial& best, glm::dvec3 start, int steps) const noexcept {
    const bool close = best.residual <= kToleranceCells * map_.cell_m();
    return {best.x, best.residual, steps, close && unfolded(start, best.x, best.at), best.at};
  }

 private:
  static constexpr double kFlat = 1e-6;
  const MotionMap& map_;
  double phase_;
  glm::dvec3 target_, closing_;
};

BackTrack newton(const MotionMap& map, const Search& search, glm::dvec3 start) noexcept {
  const double enough = kToleranceCells * map.cell_m();
  Trial best = search.look(start);
  int steps = 0;
  while (best.residual > enough && steps < kNewtonSteps) {
    const glm::dvec3 step = search.step(best);
    Trial next = search.look(best.x + step);
    ++steps;
    for (double share = 0.5; next.residual >= best.residual && steps < kNewtonSteps; share *= 0.5) {
      next = search.look(best.x + share * step);
      ++steps;
    }
    if (!(next.residual < best.residual)) break;
    best = next;
  }
  return search.result(best, start, steps);
}

BackTrack picard(const MotionMap& map, const Search& search, glm::dvec3 start) noexcept {
  const double enough = kToleranceCells * map.cell_m();
  Trial last = search.look(start), best = last;
  int steps = 0;
  while (best.residual > enough && steps < kPicardSteps) {
    last = search.look(last.x - last.miss);
    ++steps;
    if (last.residual < best.residual) best = last;
  }
  return search.result(best, start, steps);
}

}  // namespace

BackTrack back_track(const MotionMap& map, double phase, glm::dvec3 target, glm::dvec3 start,
                     glm::dvec3 closing, BackTracking method) noexcept {
  if (!finite(target) || !finite(start) || !finite(closing) || !std::isfinite(phase)) {
    BackTrack none;
    none.x_m = finite(start) ? start : glm::dvec3(0.0);
    none.residual_m = std::numeric_limits<double>::infinity();
    none.at = map.sample(none.x_m);
    return none;
  }
  const Search search(map, phase, target, closing);
  return method == BackTracking::kNewton ? newton(map, search, start) : picard(map, search, start);
}

}  // namespace palpate
