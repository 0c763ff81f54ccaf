#include "module/haptics/servo/second_hand.h"

#include <algorithm>
#include <cmath>

#include "compute/volume/portable.h"
#include "module/haptics/force_vector.h"

namespace palpate {
namespace {

/// The rotation by a vector: its length is the angle. Smooth at zero.
glm::dquat turn(glm::dvec3 by) {
  const double angle = glm::length(by);
  const auto [sine, cosine] = portable::sin_cos(0.5 * angle);
  return {cosine, (angle > 1e-8 ? sine / angle : 0.5) * by};
}

}  // namespace

Transform moved(const Transform& from, const SecondHandReading& hand, double dt_s,
                glm::dvec3 pivot_m, const MoveLimits& limits) noexcept {
  if (!is_finite(hand.linear_m_per_s) || !is_finite(hand.angular_rad_per_s) || !std::isfinite(dt_s))
    return from;
  if (hand.linear_m_per_s == glm::dvec3(0.0) && hand.angular_rad_per_s == glm::dvec3(0.0))
    return from;  // to the bit: rest must not drift
  const double step_s = std::clamp(dt_s, 0.0, limits.longest_step_s);
  const glm::dvec3 before = from.world_from_volume(pivot_m);
  glm::dvec3 after = before + step_s * hand.linear_m_per_s;
  const double reach = std::max(limits.reach_m, glm::distance(before, limits.home_m));
  const double distance = glm::distance(after, limits.home_m);
  if (distance > reach) after = limits.home_m + (after - limits.home_m) * (reach / distance);

  Transform to = from;
  to.rotation = glm::normalize(turn(step_s * hand.angular_rad_per_s) * from.rotation);
  to.translation_m = after - to.rotation * (to.scale * pivot_m);
  return to;
}

}  // namespace palpate
