#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "integration/devices/falcon_protocol.h"
#include "integration/devices/usb.h"

/// Preparing a Falcon: the settings of its USB chip (an FTDI serial converter) and its firmware.
/// All functions wait for the bus: for the worker thread, never for the servo's.
namespace palpate::devices::falcon {

inline constexpr uint16_t kVendor = 0x0403, kProduct = 0xcb48;
inline constexpr const char* kProductName = "FALCON HAPTIC";
inline constexpr uint8_t kEndpointOut = 0x02, kEndpointIn = 0x81;
/// The converter sends 64 bytes at most; the first two are its own status, not from the Falcon.
inline constexpr size_t kInBytes = 64, kStatusBytes = 2, kOutBytes = 62;

/// Set to cancel a step that takes long.
using StopFlag = std::atomic<bool>;

/// The settings for the packets' exchange: 1.5 Mbaud, latency timer at its least (1 ms), and '>'
/// as event character, at which the chip hands over what it has at once. Without the event
/// character (some chips refuse it) it still works, at the latency timer's pace.
struct Settings {
  usb::UsbProblem problem = usb::UsbProblem::kNone;
  bool event_character = false;
};
Settings set_up(libusb_device_handle* handle);

/// Whether firmware runs: it answers a packet of zero force. kTimedOut: nothing that is a packet
/// came back within about a second. Its answer goes to `answer` unless that is null.
usb::UsbProblem find_firmware(libusb_device_handle* handle, const StopFlag& stop,
                              FalconAnswer* answer = nullptr);

/// Loads the user's firmware image into the device, once; kFailed or kTimedOut if the loader in
/// it does not answer as it should, which happens and is worth another try. Takes several seconds.
/// Afterwards set_up() is due.
usb::UsbProblem load_firmware(libusb_device_handle* handle, std::span<const uint8_t> image,
                              const StopFlag& stop);

/// Motors off, lights out, whatever state the exchange was in. Returns after 50 ms at most.
usb::UsbProblem send_zero(libusb_device_handle* handle) noexcept;

/// Ends the endpoints' halt and forgets what is under way in the chip.
usb::UsbProblem clear_halts(libusb_device_handle* handle) noexcept;

}  // namespace palpate::devices::falcon
