#pragma once

#include <optional>

#include "integration/devices/usb.h"
#include "integration/devices/wake.h"

namespace palpate::devices::usb {

inline constexpr int kAnyVendor = LIBUSB_HOTPLUG_MATCH_ANY;

/// Tells a thread when something of a kind is plugged in or out. Has a context of its own, so that
/// no other thread's transfers are handled by who waits here. One thread.
class Watch {
 public:
  /// Where the system can not tell (no hot-plug in its libusb), sleep() just sleeps.
  explicit Watch(int vendor);
  ~Watch();
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  /// Sleeps until wake() is called, something is plugged in or out, or the time is over.
  void sleep(Wake& wake, int milliseconds);
  /// Whether something was plugged in or out since the last call.
  bool changed() noexcept;

 private:
  static int LIBUSB_CALL on_change(libusb_context*, libusb_device*, libusb_hotplug_event,
                                   void* watch);

  ContextPtr context_;
  std::optional<EventWaiter> waiter_;  ///< its files stay the same: no device is opened here
  libusb_hotplug_callback_handle callback_ = 0;
  bool watching_ = false;
  bool changed_ = false;
};

}  // namespace palpate::devices::usb
