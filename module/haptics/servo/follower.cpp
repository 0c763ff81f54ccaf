#include "module/haptics/servo/follower.h"

#include <cmath>

#include "compute/volume/portable.h"
#include "module/haptics/force_vector.h"

namespace palpate {

glm::dvec3 Follower::step(glm::dvec3 target_m, double dt_s) noexcept {
  if (!is_finite(target_m) || !std::isfinite(dt_s) || !(dt_s > 0.0)) return place_m_;
  const double w = settle_per_s_;
  // From the target as it counts: e(t) = (e + (v + w e) t) exp(-w t).
  const glm::dvec3 away = shortened(place_m_ - target_m, 2.0 * speed_m_per_s_ / w);
  const glm::dvec3 counted_m = place_m_ - away;
  const glm::dvec3 slope = velocity_m_per_s_ + w * away;
  const double decay = portable::exp(-w * dt_s);
  place_m_ = counted_m + (away + slope * dt_s) * decay;
  velocity_m_per_s_ = shortened((velocity_m_per_s_ - w * slope * dt_s) * decay, speed_m_per_s_);
  return place_m_;
}

}  // namespace palpate
