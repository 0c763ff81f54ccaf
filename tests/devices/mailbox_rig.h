#pragma once

#include <memory>

#include "integration/devices/mailbox_device.h"
#include "tests/devices/fault_rig.h"

namespace palpate::devices::test {

/// A DeviceRig for a device with a thread of its own: each exchange of the loop is handled before
/// the next tick, so that ticks can be counted on any machine.
class MailboxRig : public DeviceRig {
 public:
  /// Three missing answers, and one exchange until the loop gets the fault.
  static constexpr int kWithin = 4;

  /// For busy machines: a late thread does not count as hanging, and a late host does not count as
  /// away.
  static MailboxOptions patient_mailbox() {
    return {.away_ns = 5'000'000'000, .silence_ns = 10'000'000'000, .priority = 0};
  }

  std::unique_ptr<MailboxDevice> device;

 protected:
  /// Starts the device, and waits until it was searched for: then its info is known.
  void start_mailbox(std::unique_ptr<DeviceLink> link, const MailboxOptions& options) {
    device = std::make_unique<MailboxDevice>(std::move(link), options);
    wait_for([&] { return device->counts().opened > 0; });
    start(*device);
    watched->settle = [this](const DeviceReading& reading) {
      // Without a device nothing is handled, and in a call that hangs nothing ever is.
      const bool works = reading.fault == DeviceFault::kNone || reading.fresh;
      const auto end = std::chrono::steady_clock::now() +
                       (works ? std::chrono::milliseconds(5000) : std::chrono::milliseconds(1));
      while (device->counts().served == served_ && std::chrono::steady_clock::now() < end)
        std::this_thread::sleep_for(std::chrono::microseconds(20));
      served_ = device->counts().served;
      // Positions have real times: a hand that moves by the loop's time must not be too fast.
      std::this_thread::sleep_for(std::chrono::microseconds(300));
    };
  }

 private:
  uint64_t served_ = 0;
};

}  // namespace palpate::devices::test
