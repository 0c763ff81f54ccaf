#pragma once

#include <atomic>
#include <cstdint>
#include <glm/glm.hpp>

#include "module/haptics/servo/servo_loop.h"

namespace palpate {

/// What a host's haptic loop knows when it asks for a force.
struct HostTick {
  glm::dvec3 position_m{0.0};  ///< of the grip, device space: x right, y up, z towards the user
  /// When the position was taken, by a clock of the host's that runs at the usual speed and never
  /// back; 0: now.
  int64_t time_ns = 0;
  uint32_t buttons = 0;  ///< bit k: button k is down
  GripReading grip;
};

/// The servo loop of a host that has a haptic thread of its own: the same loop, guards and ramps as
/// on a Servo's thread, one period each time the host calls tick().
class HostLoop {
 public:
  /// `ticker` and the listeners are borrowed. options.period_ns is only the time before the first
  /// tick, options.exchanges is ignored.
  HostLoop(Ticker& ticker, const DeviceInfo& device, const LoopOptions& options = {},
           TickListeners listeners = {});

  /// One period: the force for the hand, device space, N. A position that is not finite, or a time
  /// that does not rise, is a fault of the device (DeviceFault::kGarbage): the force goes to zero
  /// by a ramp and comes back after it. Zero after stop(), once the ramp is over. Real-time safe;
  /// one thread at a time.
  glm::dvec3 tick(const HostTick& tick) noexcept;
  /// The torque that belongs to the force of the last tick, device space, N m. The ticks' thread.
  glm::dvec3 torque_n_m() const noexcept {
    return over_ ? glm::dvec3(0.0) : device_.command.torque_n_m;
  }

  /// The force goes to zero by a ramp in the ticks that follow. Any thread; does not wait.
  void stop() noexcept { ports_.stop.store(true); }
  /// Whether it has been stopped and the force has been zero since. Any thread.
  bool at_rest() const noexcept { return ports_.at_rest.load(std::memory_order_acquire); }

  /// As those of Servo. A pose's time is monotonic time.
  bool send(const ControlEvent& event) noexcept { return ports_.events.push(event); }
  bool send(const ControlEvent& first, const ControlEvent& second) noexcept {
    return ports_.events.push(first, second);
  }
  bool send(PoseUpdate pose) noexcept;
  bool newest(int reader, TickOutput& output) noexcept {
    return ports_.outputs[size_t(reader)].get(output);
  }
  /// Counts ticks, late ticks and faults; durations are not measured.
  const ServoStatistics& statistics() const noexcept { return ports_.statistics; }

 private:
  /// The host's device: its position is an argument of the tick, its force the tick's result.
  class HostLoopDevice final : public ForceDevice {
   public:
    explicit HostLoopDevice(const DeviceInfo& info) : info_(info) {}
    DeviceInfo info() const override { return info_; }
    DeviceReading exchange(const DeviceCommand& command) noexcept override;

    DeviceReading reading;
    DeviceCommand command;

   private:
    DeviceInfo info_;
  };
  /// The host's time of this tick, constant during it, so that the same ticks give the same forces.
  class HostLoopClock final : public ServoClock {
   public:
    int64_t now_ns() noexcept override { return time_ns; }
    void sleep_until(int64_t) noexcept override {}

    int64_t time_ns = 0;
  };

  ServoPorts ports_;
  HostLoopDevice device_;
  HostLoopClock clock_;
  std::atomic<int64_t> ahead_ns_{0};  ///< the host's clock minus the monotonic one
  ServoLoop loop_;
  bool over_ = false;
};

}  // namespace palpate
