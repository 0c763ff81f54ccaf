#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "module/haptics/device.h"

namespace palpate::devices {

/// Judges the answers of any force device: says when a position must not be trusted, and when it
/// may be trusted again. No clock and no bus: its result depends on its arguments alone. One
/// thread; real-time safe. Counts exchanges, not time, so that a late host is not taken for a
/// broken device.
class AnswerJudge {
 public:
  static constexpr int kMisses = 3;    ///< exchanges in a row without an answer: a fault
  static constexpr int kGiveUp = 100;  ///< ...: the device has to be opened again
  static constexpr int kSettle = 200;  ///< good answers after homing, before force is allowed
  static constexpr int kRecover = 20;  ///< good answers in a row after any other fault
  static constexpr int kStill = 100;   ///< exchanges without movement after the force has changed
  static constexpr double kStillForce = 1.0;  ///< N, by which it has to change
  static constexpr double kHandSpeed = 5.0;   ///< m/s; no hand is faster
  static constexpr double kJumpSlack = 1e-3;  ///< m; vibration and quantisation on top
  /// A longer pause allows no larger jump: in contact it ends the force anyway, and the short
  /// periods after it must not let an encoder's jump through.
  static constexpr double kJumpTime = 2e-3;  ///< s
  static constexpr double kInside = 0.9;     ///< share of the workspace that is not its end

  /// Where the grip can be, in device space, m. Near its end, standing still is no fault: the arms
  /// may lie against their stops.
  AnswerJudge(glm::dvec3 workspace_centre_m, double workspace_radius_m) noexcept
      : centre_m_(workspace_centre_m), inside_m_(kInside * workspace_radius_m) {
    reading_.position_m = workspace_centre_m;
  }

  /// One exchange.
  struct Exchange {
    bool answered = false;
    bool garbage = false;  ///< bytes came that were no answer
    /// With an answer: why its position is not valid. kNotHomed asks for kSettle good answers,
    /// others for kRecover.
    DeviceFault said = DeviceFault::kNone;
    glm::dvec3 position_m{0.0};  ///< of the answer
    uint32_t buttons = 0;
    GripReading grip;
    bool moved = true;        ///< some sensor reads otherwise than in the last answer
    bool one_stands = false;  ///< one sensor does not move although it would have to
    int64_t time_ns = 0;      ///< monotonic, when the exchange ended
    glm::dvec3 force_n{0.0};  ///< that the motors were told to make
  };
  DeviceReading judge(const Exchange& exchange) noexcept;

  /// The last reading, not fresh, with another fault: for when there was no exchange at all.
  DeviceReading frozen(DeviceFault fault) const noexcept;

  /// A fault that was found elsewhere (the bus, a host that did not call): latched like those found
  /// here.
  void fail(DeviceFault fault) noexcept { latch(fault, kRecover); }

  /// After the device was opened again: forgets everything but the last position.
  void restart() noexcept;

  DeviceFault fault() const noexcept { return fault_; }
  bool hopeless() const noexcept { return misses_ >= kGiveUp; }
  glm::dvec3 position() const noexcept { return reading_.position_m; }
  /// Whether a place in device space is far enough from the workspace's end.
  bool is_inside(glm::dvec3 position_m) const noexcept {
    return glm::distance(position_m, centre_m_) < inside_m_;
  }

 private:
  void latch(DeviceFault fault, int good_answers) noexcept;
  DeviceFault examine(const Exchange& exchange) noexcept;
  bool jumped(glm::dvec3 position, int64_t time_ns) const noexcept;
  bool stuck(const Exchange& exchange) noexcept;

  glm::dvec3 centre_m_;
  double inside_m_;
  DeviceReading reading_;
  DeviceFault fault_ = DeviceFault::kStarting;
  int needed_ = kRecover;  ///< good answers until the fault is over
  int misses_ = 0;
  bool garbage_ = false;  ///< among the bytes of the misses

  glm::dvec3 place_{0.0};  ///< where the last answer is, good or not
  int64_t place_ns_ = 0;
  bool placed_ = false;

  int still_ = 0;  ///< exchanges with another force than when a sensor moved last
  glm::dvec3 least_force_{0.0}, most_force_{0.0};  ///< sent meanwhile
};

}  // namespace palpate::devices
