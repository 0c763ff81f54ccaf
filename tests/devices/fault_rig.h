#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "module/haptics/proxy/haptics.h"
#include "module/haptics/servo/servo_loop.h"
#include "tests/devices/emulated_hand.h"
#include "tests/devices/print_fault.h"
#include "tests/support/wait_for.h"

namespace palpate::devices::test {

/// The loop's time advances only where the loop sleeps, by a millisecond per period, however long
/// the real transfers take. So ticks can be counted on any machine.
class LoopTime final : public ServoClock {
 public:
  int64_t now_ns() noexcept override { return now; }
  void sleep_until(int64_t time_ns) noexcept override {
    if (stands) return;
    now = std::max(now, time_ns) + oversleep_ns;
    oversleep_ns = 0;
  }
  int64_t now = 5'000'000'000;
  int64_t oversleep_ns = 0;  ///< the next sleep is longer by this
  bool stands = false;
};

/// Faults of the scene's data that a test can set during contact.
struct DataFaults {
  bool not_a_number = false;
};

/// The device as the loop uses it, checked on both sides in every exchange: no force is left in the
/// motors of a device that reports a fault, and none arrives before the device reports that it
/// works.
class WatchedDevice final : public ForceDevice {
 public:
  WatchedDevice(ForceDevice& device, EmulatedHand& hand) : device_(device), hand_(&hand) {}
  DeviceInfo info() const override { return device_.info(); }
  DeviceReading exchange(const DeviceCommand& command) noexcept override;

  /// From here on commands can not reach the motors, and the motors are not checked.
  void lose() { reachable_ = false; }
  /// They can again. Forces of before may be in the motors until the first command arrives.
  void find(EmulatedHand& hand);
  bool reachable() const { return reachable_; }

  /// Called once, in the next exchange.
  std::function<void()> during;
  /// Waits until a device with a thread of its own has handled the exchange, so that ticks can be
  /// counted. Gets the result of the exchange.
  std::function<void(const DeviceReading&)> settle;
  /// Violations; the first of each kind.
  std::vector<std::string> wrong;

 private:
  void blame(const std::string& what);
  ForceDevice& device_;
  EmulatedHand* hand_;
  bool reachable_ = true;
  /// Commands that were checked; commands before it was found again.
  size_t seen_ = 0, from_ = 0;
  DeviceFault last_ = DeviceFault::kNotOpened;
};

/// A force device above its emulation, the servo loop and the haptic step with a beating shell, and
/// a grip that a hand moves: all but the loop's thread and clock is the real code.
class DeviceRig : public TickListener {
 public:
  /// One period of the loop, in which the hand moves a little.
  void run_period();
  void run_periods(int count);
  /// False after kPatience.
  bool turn_until(const std::function<bool()>& holds);

  /// Moves into free space, until the force may come up again; then into the shell, until there is
  /// a force and the start ramp has ended.
  bool come_free();
  bool touch();
  /// The loop does not run for this time, and not until `also` is true.
  void stall_host(int milliseconds, const std::function<bool()>& also = {});
  /// Another scene from the next tick on.
  void adopt(int shells);
  /// It is plugged in, or accepts commands again.
  void find(EmulatedHand& again);
  bool pushes() const { return used_->pushes(); }

  /// Inputs and outputs, one entry per tick.
  std::vector<TickInput> inputs;
  std::vector<TickOutput> outputs;
  void hear(const TickInput& input, const TickOutput& output) noexcept override;
  double force_n(size_t tick) const { return glm::length(outputs[tick].command.force_n); }

  std::shared_ptr<DataFaults> data = std::make_shared<DataFaults>();
  LoopTime time;
  std::unique_ptr<WatchedDevice> watched;
  std::unique_ptr<Haptics> haptics;
  ServoPorts ports;
  std::unique_ptr<ServoLoop> loop;
  /// Whether the hand sets the place of the grip.
  bool holds_grip = true;

 protected:
  DeviceRig();
  /// Before the device is made: moves the hand to its place. Then call start().
  void hold(EmulatedHand& hand, glm::dvec3 centre_m);
  void start(ForceDevice& device);
  /// The hand continues from the place of the grip.
  void hand_is_at(glm::dvec3 grip_m);
  virtual void place(glm::dvec3 grip_m) { used_->place(grip_m); }

 private:
  void move_hand();
  EmulatedHand* used_ = nullptr;
  glm::dvec3 centre_m_{0.0};
  glm::dvec3 hand_, goal_;
  int64_t turn_ = 0;
};

}  // namespace palpate::devices::test
