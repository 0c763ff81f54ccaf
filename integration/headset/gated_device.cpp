#include "integration/headset/gated_device.h"

#include "module/haptics/servo/monotonic.h"

namespace palpate::headset {

DeviceReading GatedDevice::exchange(const DeviceCommand& command) noexcept {
  DeviceReading reading = device_->exchange(command);
  const int64_t now_ns = monotonic_ns();
  reading.buttons &= ~(kShown | kDeadMan);
  if (now_ns < shown_until_ns_.load(std::memory_order_relaxed)) reading.buttons |= kShown;
  if (now_ns < dead_man_until_ns_.load(std::memory_order_relaxed)) reading.buttons |= kDeadMan;
  return reading;
}

}  // namespace palpate::headset
