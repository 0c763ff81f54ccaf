#pragma once

#include <glm/glm.hpp>

namespace palpate {

/// Turns positions in steps (20 to 1,000 a second, of any size) into a motion that a hand could
/// make: a critically damped spring pulls the place after its target,
///   x'' = w^2 (target - x) - 2 w x',
/// solved exactly for each step, so that any dt is stable and the place never overshoots from rest.
/// The pull is bounded as if the target were never further away than 2 v / w: that keeps the speed
/// at most v, however far the cursor jumped. Position and velocity have no steps. A value; no
/// clock; real-time safe.
class Follower {
 public:
  /// settle_per_s: w, > 0; a steady motion is followed 2 / w s late. speed_m_per_s: v, > 0.
  Follower(glm::dvec3 place_m, double settle_per_s, double speed_m_per_s) noexcept
      : settle_per_s_(settle_per_s), speed_m_per_s_(speed_m_per_s), place_m_(place_m) {}

  /// dt_s later. A target or dt that is not finite, or dt < 0, changes nothing.
  glm::dvec3 step(glm::dvec3 target_m, double dt_s) noexcept;

  glm::dvec3 place_m() const noexcept { return place_m_; }
  glm::dvec3 velocity_m_per_s() const noexcept { return velocity_m_per_s_; }

 private:
  double settle_per_s_, speed_m_per_s_;
  glm::dvec3 place_m_, velocity_m_per_s_{0.0};
};

}  // namespace palpate
