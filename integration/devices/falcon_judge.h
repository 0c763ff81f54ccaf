#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

#include "integration/devices/falcon_protocol.h"
#include "module/haptics/device.h"

namespace palpate::devices::falcon {

/// What a Falcon's answers are worth: makes positions of them and says when they must not be
/// trusted. Plain state, no clock, no bus: what it says depends on what it was told alone. Servo
/// thread; real-time safe. Counts exchanges, not time, so that a late host is not taken for a
/// broken device.
class FalconJudge {
 public:
  static constexpr int kMisses = 3;    ///< exchanges in a row without an answer: a fault
  static constexpr int kGiveUp = 100;  ///< ...: the device has to be opened again
  static constexpr int kSettle = 200;  ///< good answers after homing, before force is allowed
  static constexpr int kRecover = 20;  ///< good answers in a row after any other fault
  static constexpr int kStill = 100;   ///< exchanges without a count after the force has changed
  static constexpr double kStillForce = 1.0;  ///< N, by which it has to change
  static constexpr int kPassed = 400;  ///< counts that both other arms move while one stands: stuck
  static constexpr double kHandSpeed = 5.0;   ///< m/s; no hand is faster
  static constexpr double kJumpSlack = 1e-3;  ///< m; vibration and quantisation on top
  /// A longer pause allows no further jump: in contact it ends the force anyway, and a host that
  /// hurries after one must not let an encoder's jump through.
  static constexpr double kJumpTime = 2e-3;  ///< s

  /// One exchange.
  struct Exchange {
    std::optional<Answer> answer;
    bool garbage = false;     ///< bytes came that were no answer
    int64_t time_ns = 0;      ///< monotonic, when it ended
    glm::dvec3 force_n{0.0};  ///< that the motors were told to make
  };
  DeviceReading judge(const Exchange& exchange) noexcept;

  /// The last reading, not fresh, with another fault: for when there was no exchange at all.
  DeviceReading held(DeviceFault fault) const noexcept;

  /// A fault from outside (the bus, a host that was away): latched like those found here.
  void fail(DeviceFault fault) noexcept { latch(fault, kRecover); }

  /// After the device was opened again: nothing is known of it but where it last was.
  void restart() noexcept;

  DeviceFault fault() const noexcept { return fault_; }
  bool homed() const noexcept { return homed_; }
  bool hopeless() const noexcept { return misses_ >= kGiveUp; }
  glm::dvec3 position() const noexcept { return reading_.position_m; }

 private:
  void latch(DeviceFault fault, int good_answers) noexcept;
  DeviceFault examine(const Exchange& exchange) noexcept;
  bool jumped(glm::dvec3 position, int64_t time_ns) noexcept;
  bool stuck(const Exchange& exchange) noexcept;

  DeviceReading reading_;
  DeviceFault fault_ = DeviceFault::kStarting;
  int needed_ = kRecover;  ///< good answers until the fault is over
  int misses_ = 0;
  bool garbage_ = false;  ///< among the bytes of the misses
  bool homed_ = false;

  glm::dvec3 place_{0.0};  ///< where the last answer is, good or not
  int64_t place_ns_ = 0;
  bool placed_ = false;

  std::array<int16_t, 3> counts_{};
  std::array<std::array<int, 3>, 3> path_{};  ///< [e][o]: counts o moved since e last did
  int still_ = 0;  ///< exchanges with another force than when an encoder moved last
  glm::dvec3 least_force_{0.0}, most_force_{0.0};  ///< sent meanwhile
};

}  // namespace palpate::devices::falcon
