#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

namespace palpate {

/// How a device's grip is held, where the device senses more than its place. Nothing is felt by it;
/// it is shown.
struct GripReading {
  bool turns = false;  ///< the next two are sensed
  /// The grip's own axes: z along its shaft, away from the tip; unit length.
  glm::dquat device_from_grip{1.0, 0.0, 0.0, 0.0};
  glm::dvec3 angular_velocity_rad_per_s{0.0};  ///< along the device's axes
  bool opens = false;                          ///< the next is sensed
  double opening_rad = 0.0;                    ///< of the gripper; 0: closed
};

/// The same without what can not be: not finite, or a rotation that is none (its length more than
/// 0.01 off 1; less is corrected). Real-time safe.
GripReading believable(GripReading grip) noexcept;

/// The unit vector from the tip along the shaft, device space; zero if it is not sensed.
inline glm::dvec3 shaft_of(const GripReading& grip) noexcept {
  return grip.turns ? grip.device_from_grip * glm::dvec3(0.0, 0.0, 1.0) : glm::dvec3(0.0);
}

}  // namespace palpate
