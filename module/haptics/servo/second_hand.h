#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>

#include "module/haptics/device.h"
#include "module/scene/transform.h"

namespace palpate {

/// How the second hand moves now. Space: the world's axes, x right, y up, z towards the user.
struct SecondHandReading {
  glm::dvec3 linear_m_per_s{0.0};
  glm::dvec3 angular_rad_per_s{0.0};  ///< direction: the axis, by the right hand's rule
  uint32_t buttons = 0;               ///< bit k: button k is down
  int64_t time_ns = 0;  ///< monotonic time of what the device said last; 0: nothing yet
  DeviceFault fault = DeviceFault::kNotOpened;  ///< velocities are zero unless this is kNone
};

/// What moves the volume while the other hand feels it.
class SecondHand {
 public:
  virtual ~SecondHand() = default;
  /// For people. Any thread, not real-time safe. workspace and force mean nothing here and are 0.
  virtual DeviceInfo info() const = 0;
  /// The newest motion; zero if the device has been silent for too long. Any number of threads;
  /// wait-free.
  virtual SecondHandReading read() const noexcept = 0;
};

/// Where a second hand may take a volume.
struct MoveLimits {
  glm::dvec3 home_m{0.0};       ///< world; the pivot stays ...
  double reach_m = 0.2;         ///< ... this close to it
  double longest_step_s = 0.1;  ///< after a longer pause only this much of it is made up for
};

/// The transform (world_from_volume) after moving for dt_s as the hand says: the pivot goes along
/// linear_m_per_s, everything turns about the pivot (volume space, m) by exp(angular dt); the scale
/// stays. A pivot that is already out of reach may only come closer; it does not jump. Values that
/// are not finite move nothing. Pure, real-time safe.
Transform moved(const Transform& from, const SecondHandReading& hand, double dt_s,
                glm::dvec3 pivot_m = glm::dvec3(0.0), const MoveLimits& limits = {}) noexcept;

}  // namespace palpate
