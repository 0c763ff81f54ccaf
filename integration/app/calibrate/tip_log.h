#pragma once

#include <atomic>
#include <vector>

#include "module/calibrate/calibrate.h"
#include "module/haptics/mailbox.h"
#include "module/haptics/ticker.h"

namespace palpate::app {

/// Lets a device be moved without any force, and keeps where its tip was.
class TipLog final : public Ticker {
 public:
  /// Real-time safe.
  TickOutput tick(const TickInput& input) noexcept override;
  /// Adds what came since the last call. One thread.
  void drain(std::vector<TipSample>& samples);
  /// The device's last answer. Any thread.
  DeviceFault fault() const { return fault_; }

 private:
  static constexpr size_t kWaiting = 16384;  // 16 s
  Ring<TipSample, kWaiting> ring_;
  std::atomic<DeviceFault> fault_{DeviceFault::kNotOpened};
};

}  // namespace palpate::app
