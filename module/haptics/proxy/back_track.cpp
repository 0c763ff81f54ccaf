#include "module/haptics/proxy/back_track.h"

#include <cmath>
#include <limits>

#include "module/haptics/force_vector.h"

namespace palpate {
namespace {

constexpr int kNewtonSteps = 16;
// The fixed point gains a factor q a step: what the paper's method needs to be compared at all.
constexpr int kPicardSteps = 64;
constexpr double kToleranceCells = 1e-6;
// How finely a path is searched for folds, and how far: beyond, it counts as folded.
constexpr double kSampleCells = 1.0 / 32.0;
constexpr int kMostPathSamples = 256;

/// One point of the search: the field there and what is missing.
struct Trial {
  glm::dvec3 x;
  glm::dvec3 miss;
  double residual;
  MotionSample at;
};

/// One step of a volume's motion, at a share of it: g (u(x) + closing).
class StepMotion {
 public:
  StepMotion(const MotionMap& map, double phase, glm::dvec3 closing)
      : map_(map), phase_(phase), closing_(closing) {}
  MotionSample sample(glm::dvec3 x) const noexcept { return map_.sample(x); }
  glm::dvec3 way(const MotionSample& at) const noexcept { return phase_ * (at.u_m + closing_); }
  /// I + g J.
  glm::dmat3 stretched(const MotionSample& at) const noexcept {
    return glm::dmat3(1.0) + phase_ * at.jacobian;
  }
  bool never_folds() const noexcept { return map_.worst_determinant() > 0.0F; }
  bool surely_unfolded(glm::dvec3 x) const noexcept {
    return map_.certificate(x).determinant > 0.0F;
  }
  double cell_m() const noexcept { return map_.cell_m(); }

 private:
  const MotionMap& map_;
  double phase_;
  glm::dvec3 closing_;
};

/// One motion for all times, at one of them: u(X, t).
class TimedMotion {
 public:
  explicit TimedMotion(SequenceSnapshot& snapshot) : snapshot_(snapshot) {}
  MotionSample sample(glm::dvec3 x) const noexcept { return snapshot_.sample(x); }
  glm::dvec3 way(const MotionSample& at) const noexcept { return at.u_m; }
  glm::dmat3 stretched(const MotionSample& at) const noexcept {
    return glm::dmat3(1.0) + at.jacobian;
  }
  bool never_folds() const noexcept { return !snapshot_.may_fold(); }
  bool surely_unfolded(glm::dvec3) const noexcept { return false; }
  double cell_m() const noexcept { return snapshot_.map().cell_m(); }

 private:
  SequenceSnapshot& snapshot_;
};

template <class Motion>
class Search {
 public:
  Search(const Motion& motion, glm::dvec3 target) : motion_(motion), target_(target) {}

  Trial look(glm::dvec3 x) const noexcept {
    Trial t{x, glm::dvec3(0.0), 0.0, motion_.sample(x)};
    t.miss = x + motion_.way(t.at) - target_;
    t.residual = std::sqrt(glm::dot(t.miss, t.miss));
    return t;
  }

  /// Newton's step (I + g J) d = -miss by Cramer's rule. Where the map is folded or all but flat
  /// it would lead to another branch: then the fixed point's step, which only follows the miss.
  glm::dvec3 step(const Trial& t) const noexcept {
    const glm::dmat3 m = motion_.stretched(t.at);
    const glm::dvec3 yz = glm::cross(m[1], m[2]);
    const double det = glm::dot(m[0], yz);
    if (!(det > kFlat)) return -t.miss;
    const glm::dvec3 zx = glm::cross(m[2], m[0]), xy = glm::cross(m[0], m[1]);
    return glm::dvec3(glm::dot(yz, t.miss), glm::dot(zx, t.miss), glm::dot(xy, t.miss)) / -det;
  }

  /// No fold on the straight way from a to b, at this time: the branch of the motion that was
  /// followed so far has not been left.
  bool unfolded(glm::dvec3 a, glm::dvec3 b, const MotionSample& at_b) const noexcept {
    if (!(glm::determinant(motion_.stretched(at_b)) > 0.0)) return false;
    if (motion_.never_folds()) return true;
    const double samples = std::ceil(glm::length(b - a) / (kSampleCells * motion_.cell_m()));
    if (!(samples <= kMostPathSamples)) return false;
    for (int k = 0; k < int(samples); ++k) {
      const glm::dvec3 x = a + (double(k) / samples) * (b - a);
      if (motion_.surely_unfolded(x)) continue;
      if (!(glm::determinant(motion_.stretched(motion_.sample(x))) > 0.0)) return false;
    }
    return true;
  }

  double enough() const noexcept { return kToleranceCells * motion_.cell_m(); }

  BackTrack result(const Trial& best, glm::dvec3 start, int steps) const noexcept {
    const bool close = best.residual <= enough();
    return {best.x, best.residual, steps, close && unfolded(start, best.x, best.at), best.at};
  }

 private:
  static constexpr double kFlat = 1e-6;
  const Motion& motion_;
  glm::dvec3 target_;
};

template <class Motion>
BackTrack newton(const Search<Motion>& search, glm::dvec3 start) noexcept {
  Trial best = search.look(start);
  int steps = 0;
  while (best.residual > search.enough() && steps < kNewtonSteps) {
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

template <class Motion>
BackTrack picard(const Search<Motion>& search, glm::dvec3 start) noexcept {
  Trial last = search.look(start), best = last;
  int steps = 0;
  while (best.residual > search.enough() && steps < kPicardSteps) {
    last = search.look(last.x - last.miss);
    ++steps;
    if (last.residual < best.residual) best = last;
  }
  return search.result(best, start, steps);
}

/// Not found, and nothing read at a place that is not finite.
BackTrack nowhere(glm::dvec3 start) noexcept {
  BackTrack none;
  none.x_m = is_finite(start) ? start : glm::dvec3(0.0);
  none.residual_m = std::numeric_limits<double>::infinity();
  return none;
}

}  // namespace

BackTrack back_track(const MotionMap& map, double phase, glm::dvec3 target, glm::dvec3 start,
                     glm::dvec3 closing, BackTracking method) noexcept {
  if (!is_finite(target) || !is_finite(start) || !is_finite(closing) || !std::isfinite(phase)) {
    BackTrack none = nowhere(start);
    none.at = map.sample(none.x_m);
    return none;
  }
  const StepMotion motion(map, phase, closing);
  const Search search(motion, target);
  return method == BackTracking::kNewton ? newton(search, start) : picard(search, start);
}

BackTrack back_track(SequenceSnapshot& motion, glm::dvec3 target, glm::dvec3 start) noexcept {
  if (!is_finite(target) || !is_finite(start)) {
    BackTrack none = nowhere(start);
    none.at = motion.sample(none.x_m);
    return none;
  }
  const TimedMotion timed(motion);
  return newton(Search(timed, target), start);
}

}  // namespace palpate
