#pragma once

#include <memory>

#include "integration/devices/mailbox_device.h"
#include "tests/devices/fault_rig.h"

namespace palpate::devices::test {

/// A DeviceRig for a device with a thread of its own: each exchange of the loop is dealt with
/// before the next tick, so that ticks can be counted on any machine.
class MailboxRig : public DeviceRig {
 public:
  /// Three answers that are missing, and one exchange until the loop gets to know.
  static constexpr int kWithin = 4;

  /// For machines that are busy: a thread that is late does not hang, and a host that is late is
  /// not away.
  static MailboxOptions patient_mailbox() {
    return {.away_ns = 5'000'000'000, .silence_ns = 10'000'000'000, .priority = 0};
  }

  std::unique_ptr<MailboxDevice> device;

 protected:
  /// The device, once it has been looked for: what it can do is known then.
  void start_mailbox(std::unique_ptr<DeviceLink> link, const MailboxOptions& options) {
    device = std::make_unique<MailboxDevice>(std::move(link), options);
    wait_for([&] { return device->counts().opened > 0; });
    start(*device);
    watched->settle = [this](const DeviceReading& reading) {
      // Where there is no device nothing is dealt with, and in a call that hangs nothing ever is.
      const bool works = reading.fault == DeviceFault::kNone || reading.fresh;
      const auto end = std::chrono::steady_clock::now() +
                       (works ? std::chrono::milliseconds(5000) : std::chrono::milliseconds(1));
      while (device->counts().served == served_ && std::chrono::steady_clock::now() < end)
        std::this_thread::sleep_for(std::chrono::microseconds(20));
      served_ = device->counts().served;
      // Positions carry real times: a hand that moves by the loop's time must not race.
      std::this_thread::sleep_for(std::chrono::microseconds(300));
    };
  }

 private:
  uint64_t served_ = 0;
};

}  // namespace palpate::devices::test
