#pragma once

#include <atomic>
#include <vector>

#include "module/calibrate/calibrate.h"
#include "module/haptics/servo/mailbox.h"
#include "module/haptics/ticker.h"

namespace palpate::app {

/// Lets the device move freely, without force, and records the positions of its tip.
class TipLog final : public Ticker {
 public:
  /// Real-time safe.
  TickOutput tick(const TickInput& input) noexcept override;
  /// Appends the samples since the last call. One thread.
  void drain(std::vector<TipSample>& samples);
  /// The fault in the device's last reading. Any thread.
  DeviceFault fault() const { return fault_; }

 private:
  static constexpr size_t kWaiting = 16384;  // 16 s
  Ring<TipSample, kWaiting> ring_;
  std::atomic<DeviceFault> fault_{DeviceFault::kNotOpened};
};

}  // namespace palpate::app
