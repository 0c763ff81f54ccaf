#pragma once

#include <libusb-1.0/libusb.h>

#include <poll.h>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

/// A thin layer over libusb: what is opened is closed, and errors are values with sentences. Only
/// this folder's .cpp files and its tests include it.
namespace palpate::devices::usb {

/// Why the bus did not do what was asked.
enum class UsbProblem : uint8_t {
  kNone,
  kNoPermission,  ///< this user may not open the device
  kBusy,          ///< another program, or a driver that can not be detached, holds it
  kGone,          ///< it was unplugged
  kStalled,       ///< the endpoint refuses until its halt is cleared
  kTimedOut,      ///< nothing happened in time
  kFailed,        ///< anything else: noise on the cable, a controller error
};

/// One sentence: what is wrong and what to do. Static storage.
const char* sentence(UsbProblem problem) noexcept;
UsbProblem problem_of(int libusb_code) noexcept;                ///< of a call's return value
UsbProblem problem_of(libusb_transfer_status status) noexcept;  ///< of an asynchronous transfer

struct CloseContext {
  void operator()(libusb_context* context) const noexcept { libusb_exit(context); }
};
/// Also gives the interface back: closing alone would leave it without the kernel's driver.
struct CloseHandle {
  int interface = -1;  ///< none is claimed
  void operator()(libusb_device_handle* handle) const noexcept {
    if (interface >= 0) libusb_release_interface(handle, interface);
    libusb_close(handle);
  }
};
struct Unref {
  void operator()(libusb_device* device) const noexcept { libusb_unref_device(device); }
};
struct FreeTransfer {
  void operator()(libusb_transfer* transfer) const noexcept { libusb_free_transfer(transfer); }
};
using ContextPtr = std::unique_ptr<libusb_context, CloseContext>;
using HandlePtr = std::unique_ptr<libusb_device_handle, CloseHandle>;
using DevicePtr = std::unique_ptr<libusb_device, Unref>;
using TransferPtr = std::unique_ptr<libusb_transfer, FreeTransfer>;

/// Null if the system has no USB at all.
ContextPtr make_context() noexcept;

/// A device on the bus, not opened.
struct BusDevice {
  DevicePtr device;
  uint16_t vendor = 0, product = 0;
  std::string address;  ///< "usb 1-2.3": bus and ports, as the kernel names it
};

/// All devices for which wanted(vendor, product) holds, in the order of the bus.
std::vector<BusDevice> find(libusb_context* context, bool (*wanted)(uint16_t, uint16_t));

/// A handle with one interface claimed, or the reason why not.
struct ClaimedDevice {
  HandlePtr handle;
  UsbProblem problem = UsbProblem::kNone;
  bool had_kernel_driver = false;  ///< it is given back when the handle closes
};

/// Opens and claims, taking the interface from the kernel's driver if there is one.
ClaimedDevice open(libusb_device* device, int interface);

/// Where a device of the HID class says what happens to it.
struct HidInput {
  int interface = 0;
  uint8_t endpoint = 0x81;
};
/// The first such interface with an endpoint that interrupts; nothing if there is none.
std::optional<HidInput> hid_input(libusb_device* device);

/// Whether a driver of the kernel holds the interface.
bool kernel_driver_active(libusb_device_handle* handle, int interface) noexcept;

/// The product's string; empty if the device does not give it.
std::string product_name(libusb_device_handle* handle);

/// Waits without rounding up to milliseconds, as libusb's own waiting does, and without taking its
/// locks while it sleeps. Made after the device is opened, by the thread that is in charge of the
/// context; used by one thread.
class EventWaiter {
 public:
  explicit EventWaiter(libusb_context* context);
  /// Sleeps until the context has events, or `nanoseconds` are over; then handles what is there.
  /// Callbacks run in here.
  void wait(int64_t nanoseconds) noexcept;
  /// Handles what is there. Callbacks run in here.
  void handle() noexcept;
  std::span<const pollfd> files() const noexcept { return {files_.data(), count_}; }

 private:
  libusb_context* context_;
  std::array<pollfd, 8> files_{};
  size_t count_ = 0;
};

}  // namespace palpate::devices::usb
