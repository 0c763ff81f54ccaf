#include "module/haptics/grip.h"

#include <cmath>

#include "module/haptics/force_vector.h"

namespace palpate {

GripReading believable(GripReading grip) noexcept {
  constexpr double kSlack = 0.01;
  const double length = glm::length(grip.device_from_grip);
  // Not finite: false.
  const bool is_rotation = std::abs(length - 1.0) <= kSlack;
  if (!grip.turns || !is_rotation || !is_finite(grip.angular_velocity_rad_per_s)) {
    grip.turns = false;
    grip.device_from_grip = {1.0, 0.0, 0.0, 0.0};
    grip.angular_velocity_rad_per_s = glm::dvec3(0.0);
  } else {
    grip.device_from_grip /= length;
  }
  if (!grip.opens || !std::isfinite(grip.opening_rad)) {
    grip.opens = false;
    grip.opening_rad = 0.0;
  }
  return grip;
}

}  // namespace palpate
