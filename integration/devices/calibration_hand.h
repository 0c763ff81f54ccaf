#pragma once

#include <atomic>
#include <cstdint>

#include "module/haptics/device.h"
#include "module/haptics/mailbox.h"

namespace palpate::devices {

/// A device without hardware that goes where a calibration wants a person's hand to go: it waits at
/// a place until it is told another one, or wanders about. The controller that would be held to it
/// is the OpenXR runtime's business; to that end the wandering is a function of the monotonic clock
/// alone.
class CalibrationHand final : public ForceDevice {
 public:
  static constexpr double kReach_m = 0.08;

  /// Is there from the next exchange on, device space, m. One thread; wait-free.
  void go_to(glm::dvec3 place_m) noexcept { places_.put(place_m); }
  /// Wanders from now on. Any thread.
  void wander() noexcept { wanders_ = true; }
  /// Where it is at a time then: three slow sines of different rates within the reach.
  static glm::dvec3 wander_m(int64_t monotonic_ns) noexcept;

  DeviceInfo info() const override;
  DeviceReading exchange(const DeviceCommand& command) noexcept override;

 private:
  Newest<glm::dvec3> places_;
  glm::dvec3 place_m_{0.0};
  std::atomic<bool> wanders_{false};
};

}  // namespace palpate::devices
