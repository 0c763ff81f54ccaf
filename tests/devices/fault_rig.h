#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "module/haptics/haptics.h"
#include "module/haptics/servo_loop.h"
#include "tests/devices/emulated_hand.h"
#include "tests/devices/print_fault.h"
#include "tests/support/wait_for.h"

namespace palpate::devices::test {

/// The loop's time: it passes only where the loop sleeps, a millisecond for a period, however long
/// the real transfers below take. So ticks can be counted on any machine.
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

/// What a test can do to the scene's data while they are felt.
struct DataFaults {
  bool not_a_number = false;
};

/// The device as the loop sees it, looked at from both sides in every exchange: whatever happens,
/// no force is left in the motors of a device that is said not to work, and none gets there before
/// it is said to work.
class WatchedDevice final : public ForceDevice {
 public:
  WatchedDevice(ForceDevice& device, EmulatedHand& hand) : device_(device), hand_(&hand) {}
  DeviceInfo info() const override { return device_.info(); }
  DeviceReading exchange(const DeviceCommand& command) noexcept override;

  /// From here on commands can not reach the motors, and nothing can be asked of them.
  void lose() { reachable_ = false; }
  /// They can again; what the motors hold until the first one comes is of before.
  void find(EmulatedHand& hand);
  bool reachable() const { return reachable_; }

  std::function<void()> during;  ///< once, in the next exchange
  /// A device with a thread of its own has dealt with the exchange when this returns, so that ticks
  /// can be counted; told what the exchange gave.
  std::function<void(const DeviceReading&)> settle;
  std::vector<std::string> wrong;  ///< what was seen and must not be; the first of each kind

 private:
  void blame(const std::string& what);
  ForceDevice& device_;
  EmulatedHand* hand_;
  bool reachable_ = true;
  size_t seen_ = 0, from_ = 0;  ///< commands looked at; commands before it was found
  DeviceFault last_ = DeviceFault::kNotOpened;
};

/// A force device above its emulation, the servo loop and the haptic step with a beating shell, and
/// a grip that a hand moves: everything but the loop's thread and clock is the real thing.
class DeviceRig : public TickListener {
 public:
  /// One period of the loop, with the hand a little further on its way.
  void run_period();
  void run_periods(int count);
  /// False after kPatience.
  bool turn_until(const std::function<bool()>& holds);

  /// Into free space, until the force may come up again; then into the shell, until there is a
  /// force and the guards have let all of it in.
  bool come_free();
  bool touch();
  /// The loop does not run for so long, nor until `also` holds.
  void stall_host(int milliseconds, const std::function<bool()>& also = {});
  /// Another scene from the next tick on.
  void adopt(int shells);
  /// It is plugged in, or takes commands again.
  void find(EmulatedHand& again);
  bool pushes() const { return used_->pushes(); }

  /// What happened, one entry per tick.
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
  bool holds_grip = true;  ///< the hand says where the grip is

 protected:
  DeviceRig();
  /// Before the device is made: the hand comes to its place. Then start().
  void hold(EmulatedHand& hand, glm::dvec3 centre_m);
  void start(ForceDevice& device);
  /// The hand goes on from where the grip is.
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
