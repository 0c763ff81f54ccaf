#include "integration/devices/list.h"

#include <fmt/format.h>

#include <chrono>
#include <thread>

#include "integration/devices/bus_devices.h"
#include "integration/devices/force_devices.h"
#include "integration/devices/simulated.h"

namespace palpate::devices {
namespace {

constexpr std::chrono::milliseconds kMostWait{1500};

/// Opens a device of a kind to see what it reports, its motors at zero all the time; nothing if
/// there is none.
std::optional<ListedDevice> check_kind(const ForceDeviceKind& kind) {
  if (!kind.may_be_there({})) return std::nullopt;
  const auto device = kind.make({});
  if (!device) return std::nullopt;
  DeviceFault fault = DeviceFault::kNotOpened;
  const auto end = std::chrono::steady_clock::now() + kMostWait;
  const auto unknown = [&] {
    return fault == DeviceFault::kNotOpened || fault == DeviceFault::kStarting;
  };
  while (unknown() && std::chrono::steady_clock::now() < end) {
    fault = (*device)->exchange({}).fault;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  ListedDevice listed;
  listed.info = (*device)->info();
  if (fault == DeviceFault::kNotHomed)
    listed.notes = kind.homing;
  else if (fault == DeviceFault::kNotOpened)
    listed.wrong = fmt::format("What drives a {} is there, but no device: plug it in.", kind.name);
  else if (fault == DeviceFault::kStarting)
    listed.wrong = "It is not ready: look to its power supply, and to its maker's program.";
  else if (fault != DeviceFault::kNone)
    listed.wrong = sentence(fault);
  listed.usable = listed.wrong.empty();
  return listed;
}

ListedDevice simulated() {
  ListedDevice listed;
  listed.info = info_of(SimulatedOptions());
  listed.usable = true;
  return listed;
}

}  // namespace

DeviceList list_devices() {
  DeviceList list;
  list_bus(list);
  for (const ForceDeviceKind& kind : force_device_kinds()) {
    if (!kind.listed_by_opening) continue;
    if (auto listed = check_kind(kind)) list.devices.push_back(std::move(*listed));
  }
  list.devices.push_back(simulated());
  return list;
}

}  // namespace palpate::devices
