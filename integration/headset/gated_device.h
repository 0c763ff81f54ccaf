#pragma once

#include <atomic>
#include <limits>
#include <memory>

#include "module/haptics/device.h"
#include "module/haptics/guard/safety.h"

namespace palpate::headset {

/// What happens to the force when the picture in the headset is lost.
enum class OnHeadsetLoss { kRamp, kGoOn };

/// A force device whose force also depends on the headset. It adds two buttons. Each is down until
/// a time that the headset's thread has to extend again and again: if that thread stops, on purpose
/// or because it hangs, the button is released.
class GatedDevice final : public ForceDevice {
 public:
  static constexpr uint32_t kShown = 1u << 30;    ///< a picture is shown in the headset
  static constexpr uint32_t kDeadMan = 1u << 31;  ///< a controller's dead-man switch is held

  /// All others: the device's own buttons.
  static constexpr uint32_t kOwn = ~(kShown | kDeadMan);

  /// There is force only while the picture is shown; the dead-man, where one is asked for, is any
  /// other button.
  static void guard(SafetyOptions& safety) {
    safety.shown_buttons = kShown;
    safety.dead_man_buttons = ~kShown;
  }

  explicit GatedDevice(std::unique_ptr<ForceDevice> device,
                       OnHeadsetLoss on_loss = OnHeadsetLoss::kRamp)
      : device_(std::move(device)), on_loss_(on_loss) {
    if (on_loss == OnHeadsetLoss::kGoOn) shown_until(std::numeric_limits<int64_t>::max());
  }

  OnHeadsetLoss on_loss() const { return on_loss_; }

  /// Holds a button down until that time (monotonic); a time in the past releases it. Any thread;
  /// wait-free.
  void shown_until(int64_t ns) noexcept { shown_until_ns_.store(ns, std::memory_order_relaxed); }
  void dead_man_until(int64_t ns) noexcept {
    dead_man_until_ns_.store(ns, std::memory_order_relaxed);
  }

  DeviceInfo info() const override { return device_->info(); }
  /// Real-time safe.
  DeviceReading exchange(const DeviceCommand& command) noexcept override;

 private:
  std::unique_ptr<ForceDevice> device_;
  const OnHeadsetLoss on_loss_;
  std::atomic<int64_t> shown_until_ns_{0}, dead_man_until_ns_{0};
};

/// The buttons that release stream tubes: the device's own, or none if one of them is the dead-man.
inline uint32_t tube_buttons(const SafetyOptions& safety) {
  return safety.dead_man ? 0 : GatedDevice::kOwn;
}

}  // namespace palpate::headset
