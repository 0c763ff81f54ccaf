#include "integration/devices/force_devices.h"

#include <charconv>
#include <chrono>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "integration/devices/force_dimension.h"
#include "integration/devices/haply.h"
#include "integration/devices/mailbox_device.h"
#include "integration/devices/touch.h"
#ifndef _WIN32
#include "integration/devices/falcon.h"
#include "integration/devices/polhem.h"
#endif

namespace palpate::devices {
namespace {

using DeviceResult = Result<std::unique_ptr<ForceDevice>>;

#ifndef _WIN32
// ---- Novint Falcon

DeviceResult make_falcon(const ForceDeviceOptions& options) {
  FalconOptions falcon;
  falcon.firmware_file = options.firmware_file;
  falcon.address = options.address;
  auto made = FalconDevice::make(falcon);
  if (!made) return made.error();
  return std::unique_ptr<ForceDevice>(std::move(*made));
}

bool falcon_may_be_there(const ForceDeviceOptions&) {
  return FalconDevice::is_plugged_in();
}

#endif

// ---- Haply

std::optional<uint16_t> port_of(std::string_view text) {
  uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error != std::errc() || end != text.data() + text.size() || port == 0) return std::nullopt;
  return port;
}

/// "049D", or "localhost:10001", or with the port of the events, "localhost:10001:10020".
Result<HaplyOptions> haply_options(const std::string& address) {
  HaplyOptions options;
  const size_t colon = address.find(':');
  if (colon == std::string::npos) {
    options.device_id = address;
    return options;
  }
  options.host = address.substr(0, colon);
  const std::string ports = address.substr(colon + 1);
  const size_t second = ports.find(':');
  const auto port = port_of(ports.substr(0, second));
  const auto events =
      second == std::string::npos ? options.events_port : port_of(ports.substr(second + 1));
  if (options.host.empty() || !port || !events)
    return Error{ErrorKind::kBadInput,
                 "'" + address +
                     "' is no address of a Haply device: give its number (049D), or where "
                     "its service is (localhost:10001)"};
  options.port = *port;
  options.events_port = *events;
  return options;
}

DeviceResult make_haply(const ForceDeviceOptions& options) {
  auto haply = haply_options(options.address);
  if (!haply) return haply.error();
  return device_of_link(make_haply_link(*haply), options);
}

bool haply_may_be_there(const ForceDeviceOptions& options) {
  const auto haply = haply_options(options.address);
  return haply && haply_service_answers(*haply);
}

// ---- Force Dimension

Result<ForceDimensionOptions> force_dimension_options(const std::string& address) {
  ForceDimensionOptions options;
  if (address.empty()) return options;
  const char* const end = address.data() + address.size();
  const auto [last, error] = std::from_chars(address.data(), end, options.index);
  if (error != std::errc() || last != end || options.index < 0)
    return Error{ErrorKind::kBadInput, "'" + address +
                                           "' is no address of a Force Dimension device: give its "
                                           "number, from 0"};
  return options;
}

DeviceResult make_force_dimension(const ForceDeviceOptions& options) {
  const auto of_address = force_dimension_options(options.address);
  if (!of_address) return of_address.error();
  return device_of_link(make_force_dimension_link(*of_address), options);
}

bool force_dimension_may_be_there(const ForceDeviceOptions&) {
  return force_dimension_library_is_there({});
}

// ---- Touch

DeviceResult make_touch(const ForceDeviceOptions& options) {
  TouchOptions touch;
  touch.configuration = options.address;
  return device_of_link(make_touch_link(touch), options);
}

bool touch_may_be_there(const ForceDeviceOptions&) {
  return touch_library_is_there({});
}

#ifndef _WIN32
// ---- Polhem

DeviceResult make_polhem(const ForceDeviceOptions& options) {
  PolhemOptions polhem;
  polhem.port = options.address;
  return device_of_link(make_polhem_link(polhem), options);
}

bool polhem_may_be_there(const ForceDeviceOptions& options) {
  return !options.address.empty() || !polhem_ports().empty();
}

#endif

/// On Windows without those that palpate drives itself on a bus of the system.
std::vector<ForceDeviceKind>& kinds() {
  static std::vector<ForceDeviceKind> all{
#ifndef _WIN32
      ForceDeviceKind{"falcon", "Novint Falcon", "usb 1-2",
                      "Pull the grip all the way out, then push it all the way in.",
                      falcon_may_be_there, make_falcon, false},
#endif
      ForceDeviceKind{"haply", "Haply Inverse3", "049D, or localhost:10001",
                      "Calibrate it as its maker says: Haply Hub shows how.", haply_may_be_there,
                      make_haply, true},
      ForceDeviceKind{"force-dimension", "Force Dimension omega, delta, sigma or lambda", "0",
                      "Initialise it with its maker's program: palpate does not move the arm.",
                      force_dimension_may_be_there, make_force_dimension, true},
      ForceDeviceKind{"touch", "3D Systems Touch, Touch X or Phantom", "Default Device",
                      "Put the pen into its inkwell for two seconds and take it out again; a "
                      "device without one is calibrated with its maker's program.",
                      touch_may_be_there, make_touch, true},
#ifndef _WIN32
      ForceDeviceKind{"polhem", "Polhem or WoodenHaptics arm", "/dev/ttyACM0",
                      "Put the arm where its maker says and calibrate it with its maker's program.",
                      polhem_may_be_there, make_polhem, true},
#endif
  };
  return all;
}

}  // namespace

std::span<const ForceDeviceKind> force_device_kinds() {
  return kinds();
}

void add_force_device_kind(const ForceDeviceKind& kind) {
  kinds().push_back(kind);
}

const ForceDeviceKind* force_device_kind(const std::string& word) {
  for (const ForceDeviceKind& kind : kinds())
    if (word == kind.kind) return &kind;
  return nullptr;
}

std::unique_ptr<ForceDevice> device_of_link(std::unique_ptr<DeviceLink> link,
                                            const ForceDeviceOptions& options) {
  MailboxOptions mailbox;
  if (!options.real_time) mailbox.priority = 0;
  return std::make_unique<MailboxDevice>(std::move(link), mailbox);
}

ForceDeviceName force_device_name(const std::string& text) {
  const size_t at = text.find('@');
  return {text.substr(0, at), at == std::string::npos ? "" : text.substr(at + 1)};
}

namespace {

constexpr int kTrials = 100;  // of 10 ms: an open device answers in far less

/// Whether a device is there at all. Its firmware or homing may still be in the way.
bool answers(ForceDevice& device) {
  for (int k = 0; k < kTrials; ++k) {
    const DeviceFault fault = device.exchange({}).fault;
    if (fault != DeviceFault::kNotOpened && fault != DeviceFault::kUnplugged) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

}  // namespace

DeviceResult find_force_device(const std::string& name, ForceDeviceOptions options) {
  auto [word, address] = force_device_name(name);
  const bool any = name == "auto";
  if (!any && !force_device_kind(word)) {
    std::string known = "auto";
    for (const ForceDeviceKind& kind : force_device_kinds()) known += std::string(", ") + kind.kind;
    return Error{ErrorKind::kBadInput,
                 "There is no force device '" + name + "': choose one of " + known};
  }
  options.address = std::move(address);
  for (const ForceDeviceKind& kind : force_device_kinds()) {
    if (!any && word != kind.kind) continue;
    // A device that is not there is not waited for: that would delay the first picture by a second.
    const bool there = kind.may_be_there(options);
    if (any && !there) continue;
    auto device = kind.make(options);
    if (!device) return device.error();
    const bool answered = there && answers(**device);
    if (!any || answered) return device;
  }
  return std::unique_ptr<ForceDevice>();
}

}  // namespace palpate::devices
