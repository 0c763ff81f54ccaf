#include "integration/devices/usb.h"

#include <algorithm>
#include <ctime>

namespace palpate::devices::usb {
namespace {

/// As the kernel names the device: bus, then the port at each hub on the way.
std::string place_of(libusb_device* device) {
  std::string address = "usb " + std::to_string(libusb_get_bus_number(device));
  std::array<uint8_t, 7> ports{};  // USB's depth
  const int count = libusb_get_port_numbers(device, ports.data(), int(ports.size()));
  for (int n = 0; n < count; ++n)
    address += (n == 0 ? "-" : ".") + std::to_string(ports[size_t(n)]);
  return address;
}

}  // namespace

const char* sentence(UsbProblem problem) noexcept {
  switch (problem) {
    case UsbProblem::kNone:
      return "The bus works.";
    case UsbProblem::kNoPermission:
      return "This user may not open the device: install the udev rule 60-palpate.rules and plug "
             "it in again.";
    case UsbProblem::kBusy:
      return "Another program or driver holds the device: close it.";
    case UsbProblem::kGone:
      return "The device was unplugged.";
    case UsbProblem::kStalled:
      return "The device refused a transfer.";
    case UsbProblem::kTimedOut:
      return "The device did not answer in time.";
    case UsbProblem::kFailed:
      return "The USB bus failed: try another cable or port.";
  }
  return "The USB bus has an unknown problem.";
}

UsbProblem problem_of(int libusb_code) noexcept {
  if (libusb_code >= 0) return UsbProblem::kNone;
  switch (libusb_code) {
    case LIBUSB_ERROR_ACCESS:
      return UsbProblem::kNoPermission;
    case LIBUSB_ERROR_BUSY:
      return UsbProblem::kBusy;
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
      return UsbProblem::kGone;
    case LIBUSB_ERROR_PIPE:
      return UsbProblem::kStalled;
    case LIBUSB_ERROR_TIMEOUT:
      return UsbProblem::kTimedOut;
    default:
      return UsbProblem::kFailed;
  }
}

UsbProblem problem_of(libusb_transfer_status status) noexcept {
  switch (status) {
    case LIBUSB_TRANSFER_COMPLETED:
    case LIBUSB_TRANSFER_CANCELLED:  // only ever by us
      return UsbProblem::kNone;
    case LIBUSB_TRANSFER_TIMED_OUT:
      return UsbProblem::kTimedOut;
    case LIBUSB_TRANSFER_STALL:
      return UsbProblem::kStalled;
    case LIBUSB_TRANSFER_NO_DEVICE:
      return UsbProblem::kGone;
    default:
      return UsbProblem::kFailed;
  }
}

ContextPtr make_context() noexcept {
  libusb_context* context = nullptr;
  if (libusb_init(&context) != LIBUSB_SUCCESS) return nullptr;
  libusb_set_option(context, LIBUSB_OPTION_LOG_LEVEL, LIBUSB_LOG_LEVEL_NONE);
  return ContextPtr(context);
}

std::vector<BusDevice> find(libusb_context* context, bool (*wanted)(uint16_t, uint16_t)) {
  std::vector<BusDevice> found;
  libusb_device** list = nullptr;
  const ssize_t count = libusb_get_device_list(context, &list);
  for (ssize_t n = 0; n < count; ++n) {
    libusb_device_descriptor descriptor{};
    if (libusb_get_device_descriptor(list[n], &descriptor) != LIBUSB_SUCCESS) continue;
    if (!wanted(descriptor.idVendor, descriptor.idProduct)) continue;
    found.push_back({DevicePtr(libusb_ref_device(list[n])), descriptor.idVendor,
                     descriptor.idProduct, place_of(list[n])});
  }
  if (count >= 0) libusb_free_device_list(list, 1);
  // libusb lists the newest first when devices are plugged in while it runs.
  std::sort(found.begin(), found.end(),
            [](const BusDevice& a, const BusDevice& b) { return a.address < b.address; });
  return found;
}

ClaimedDevice open(libusb_device* device, int interface) {
  ClaimedDevice opened;
  libusb_device_handle* handle = nullptr;
  opened.problem = problem_of(libusb_open(device, &handle));
  if (opened.problem != UsbProblem::kNone) return opened;
  opened.handle.reset(handle);
  opened.had_kernel_driver = kernel_driver_active(handle, interface);
  libusb_set_auto_detach_kernel_driver(handle, 1);
  opened.problem = problem_of(libusb_claim_interface(handle, interface));
  if (opened.problem == UsbProblem::kNone)
    opened.handle.get_deleter().interface = interface;
  else
    opened.handle.reset();
  return opened;
}

std::optional<HidInput> hid_input(libusb_device* device) {
  libusb_config_descriptor* config = nullptr;
  if (libusb_get_active_config_descriptor(device, &config) != LIBUSB_SUCCESS) return std::nullopt;
  const std::unique_ptr<libusb_config_descriptor, void (*)(libusb_config_descriptor*)> freed(
      config, libusb_free_config_descriptor);
  for (int i = 0; i < config->bNumInterfaces; ++i) {
    if (config->interface[i].num_altsetting < 1) continue;
    const libusb_interface_descriptor& setting = config->interface[i].altsetting[0];
    if (setting.bInterfaceClass != LIBUSB_CLASS_HID) continue;
    for (int e = 0; e < setting.bNumEndpoints; ++e) {
      const libusb_endpoint_descriptor& endpoint = setting.endpoint[e];
      const int kind = endpoint.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK;
      if (kind == LIBUSB_TRANSFER_TYPE_INTERRUPT &&
          (endpoint.bEndpointAddress & LIBUSB_ENDPOINT_DIR_MASK) == LIBUSB_ENDPOINT_IN)
        return HidInput{setting.bInterfaceNumber, endpoint.bEndpointAddress};
    }
  }
  return std::nullopt;
}

bool kernel_driver_active(libusb_device_handle* handle, int interface) noexcept {
  return libusb_kernel_driver_active(handle, interface) == 1;
}

std::string product_name(libusb_device_handle* handle) {
  libusb_device_descriptor descriptor{};
  if (libusb_get_device_descriptor(libusb_get_device(handle), &descriptor) != LIBUSB_SUCCESS ||
      descriptor.iProduct == 0)
    return {};
  std::array<unsigned char, 128> text{};
  const int length = libusb_get_string_descriptor_ascii(handle, descriptor.iProduct, text.data(),
                                                        int(text.size()));
  return length > 0 ? std::string(text.begin(), text.begin() + length) : std::string();
}

EventWaiter::EventWaiter(libusb_context* context) : context_(context) {
  const libusb_pollfd** list = libusb_get_pollfds(context);
  for (size_t n = 0; list && list[n] && count_ < files_.size(); ++n)
    files_[count_++] = {list[n]->fd, list[n]->events, 0};
  libusb_free_pollfds(list);
}

void EventWaiter::wait(int64_t nanoseconds) noexcept {
  const int64_t span = std::max<int64_t>(nanoseconds, 0);
  const timespec time{time_t(span / 1'000'000'000), long(span % 1'000'000'000)};
  if (ppoll(files_.data(), nfds_t(count_), &time, nullptr) > 0) handle();
}

void EventWaiter::handle() noexcept {
  timeval none{0, 0};
  libusb_handle_events_timeout_completed(context_, &none, nullptr);
}

}  // namespace palpate::devices::usb
