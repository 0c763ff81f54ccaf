#include "integration/devices/usb_watch.h"

namespace palpate::devices::usb {

Watch::Watch(int vendor) : context_(make_context()) {
  if (!context_ || !libusb_has_capability(LIBUSB_CAP_HAS_HOTPLUG)) return;
  watching_ =
      libusb_hotplug_register_callback(
          context_.get(), LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED | LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT, 0,
          vendor, LIBUSB_HOTPLUG_MATCH_ANY, LIBUSB_HOTPLUG_MATCH_ANY, on_change, this,
          &callback_) == LIBUSB_SUCCESS;
  waiter_.emplace(context_.get());
}

Watch::~Watch() {
  if (watching_) libusb_hotplug_deregister_callback(context_.get(), callback_);
}

void Watch::sleep(Wake& wake, int milliseconds) {
  if (!watching_) {
    wake.sleep(milliseconds);
    return;
  }
  wake.sleep(milliseconds, waiter_->files());
  waiter_->handle();
}

bool Watch::changed() noexcept {
  const bool was = changed_;
  changed_ = false;
  return was;
}

int LIBUSB_CALL Watch::on_change(libusb_context*, libusb_device*, libusb_hotplug_event,
                                 void* watch) {
  static_cast<Watch*>(watch)->changed_ = true;
  return 0;
}

}  // namespace palpate::devices::usb
