#pragma once

#include <atomic>
#include <cstdint>

#include "module/haptics/device.h"
#include "module/haptics/servo/mailbox.h"

namespace palpate::devices {

/// A device without hardware for calibrations: it waits at a place until it gets another one, or
/// wanders about. A simulated OpenXR runtime can follow it with a controller, because the wandering
/// is a function of the monotonic clock alone.
class CalibrationHand final : public ForceDevice {
 public:
  static constexpr double kReach_m = 0.08;

  /// It is at that place in all readings with a later time; device space, m. One thread; wait-free.
  void go_to(glm::dvec3 place_m) noexcept { places_.put(place_m); }
  /// Wanders from now on. Any thread.
  void wander() noexcept { wanders_ = true; }
  /// Its place at a time while it wanders: three slow sines of different rates within the reach.
  static glm::dvec3 wander_m(int64_t monotonic_ns) noexcept;

  DeviceInfo info() const override;
  DeviceReading exchange(const DeviceCommand& command) noexcept override;

 private:
  Newest<glm::dvec3> places_;
  glm::dvec3 place_m_{0.0};
  std::atomic<bool> wanders_{false};
};

}  // namespace palpate::devices
