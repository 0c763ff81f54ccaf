#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "integration/app/commands.h"
#include "integration/app/exit_code.h"
#include "integration/app/force_device.h"
#include "integration/app/gpu.h"
#include "integration/app/session_flags.h"
#include "integration/devices/list.h"

namespace palpate::app {
namespace {

constexpr const char* kNoDriver =
    "No Vulkan driver was found: install one (Debian: mesa-vulkan-drivers has lavapipe for any "
    "CPU).";

int default_device() {
  const auto context = vulkan::Context::open({});
  return context ? (*context)->info().index : -1;
}

nlohmann::json device_json(const vulkan::GpuInfo& device, bool is_default) {
  return {{"index", device.index},
          {"name", device.name},
          {"kind", device.kind},
          {"driver", device.driver},
          {"vulkan", fmt::format("{}.{}", device.api_major, device.api_minor)},
          {"memory_bytes", device.memory_bytes},
          {"largest_binding_bytes", device.binding_bytes},
          {"usable", device.usable},
          {"missing", device.missing},
          {"default", is_default}};
}

void print_table(const std::vector<vulkan::GpuInfo>& devices, int chosen) {
  size_t name_width = 4, kind_width = 4, driver_width = 6;
  for (const auto& device : devices) {
    name_width = std::max(name_width, device.name.size());
    kind_width = std::max(kind_width, device.kind.size());
    driver_width = std::max(driver_width, device.driver.size());
  }
  fmt::print("  no  {:{}}  {:{}}  {:{}}  vulkan  memory   binding  usable\n", "name", name_width,
             "kind", kind_width, "driver", driver_width);
  for (const auto& device : devices) {
    fmt::print("{} {:2}  {:{}}  {:{}}  {:{}}  {:<6}  {:7}  {:7}  {}\n",
               device.index == chosen ? '*' : ' ', device.index, device.name, name_width,
               device.kind, kind_width, device.driver, driver_width,
               fmt::format("{}.{}", device.api_major, device.api_minor),
               bytes_text(double(device.memory_bytes)), bytes_text(double(device.binding_bytes)),
               device.usable ? "yes" : "no: " + device.missing);
  }
  if (chosen >= 0)
    fmt::print("  * is used unless --gpu says otherwise, with a number or part of a name.\n");
}

nlohmann::json device_json(const devices::ListedDevice& device) {
  const DeviceInfo& info = device.info;
  return {{"kind", info.kind},
          {"role", device.role == devices::ListedDevice::Role::kForce ? "force" : "second hand"},
          {"name", info.name},
          {"place", info.address},
          {"usb_id", device.usb_id},
          {"usable", device.usable},
          {"wrong", with_flags(device.wrong)},
          {"notes", device.notes},
          {"max_force_n", info.max_force_n},
          {"max_stiffness_n_per_m", info.max_stiffness_n_per_m},
          {"workspace_radius_m", info.workspace_radius_m},
          {"resolution_m", info.resolution_m},
          {"sensed_dof", info.sensed_dof},
          {"actuated_dof", info.actuated_dof},
          {"buttons", info.buttons}};
}

/// The device's properties as in a data sheet; empty if unknown.
std::string abilities(const DeviceInfo& info) {
  std::vector<std::string> words;
  if (info.max_force_n > 0.0)
    words.push_back(fmt::format("{:.1f} N in every direction", info.max_force_n));
  if (info.max_stiffness_n_per_m > 0.0)
    words.push_back(fmt::format("up to {:.0f} N/m", info.max_stiffness_n_per_m));
  if (info.workspace_radius_m > 0.0)
    words.push_back(fmt::format("a ball of {:.0f} mm radius", 1e3 * info.workspace_radius_m));
  if (info.resolution_m > 0.0)
    words.push_back(fmt::format("resolves {:.0f} um", 1e6 * info.resolution_m));
  if (info.sensed_dof == 6) words.push_back("moves and turns");
  if (info.buttons > 0)
    words.push_back(fmt::format("{} button{}", info.buttons, info.buttons == 1 ? "" : "s"));
  return fmt::format("{}", fmt::join(words, ", "));
}

void print_hand(const devices::ListedDevice& device) {
  const DeviceInfo& info = device.info;
  fmt::print("  {:<15}  {}{}\n", info.kind, info.name,
             info.address.empty()    ? ""
             : device.usb_id.empty() ? ", " + info.address
                                     : fmt::format(", {} ({})", info.address, device.usb_id));
  if (const std::string words = abilities(info); device.usable && !words.empty())
    fmt::print("                   {}\n", words);
  fmt::print("                   {}\n", device.usable ? "Ready." : with_flags(device.wrong));
  if (!device.notes.empty()) fmt::print("                   {}\n", device.notes);
}

void print_hands(const devices::DeviceList& list) {
  using Role = devices::ListedDevice::Role;
  fmt::print("\nThe hand that feels\n");
  for (const auto& device : list.devices)
    if (device.role == Role::kForce) print_hand(device);
  if (list.devices.front().info.kind == "simulated")
    fmt::print("  No real one is there: {} would do.\n", devices_that_would_do());
  fmt::print("\nThe hand that moves the volume\n");
  bool any = false;
  for (const auto& device : list.devices) {
    if (device.role != Role::kSecondHand) continue;
    print_hand(device);
    any = true;
  }
  if (!any)
    fmt::print("  None is {}.\n",
               list.wrong.empty() ? "plugged in: a 3Dconnexion SpaceMouse would do" : "found");
  if (!list.wrong.empty()) fmt::print("\n{}\n", with_flags(list.wrong));
}

int run(bool json) {
  const auto computing = vulkan::list_devices();
  const int chosen = default_device();
  const devices::DeviceList hands = devices::list_devices();
  if (json) {
    nlohmann::json all = {{"vulkan", nlohmann::json::array()},
                          {"hands", nlohmann::json::array()},
                          {"wrong", with_flags(hands.wrong)}};
    for (const auto& device : computing)
      all["vulkan"].push_back(device_json(device, device.index == chosen));
    for (const auto& device : hands.devices) all["hands"].push_back(device_json(device));
    fmt::print("{}\n", all.dump(2));
  } else {
    fmt::print("What computes\n");
    if (!computing.empty()) print_table(computing, chosen);
    print_hands(hands);
  }
  if (chosen >= 0) return kExitOk;
  std::fflush(stdout);
  fmt::print(stderr, "palpate: {}\n",
             computing.empty() ? kNoDriver : "None of the Vulkan devices can be used.");
  return kExitBad;
}

}  // namespace

Command add_devices(CLI::App& program) {
  CLI::App* app = program.add_subcommand(
      "devices", "List what computes, what lets you feel and what moves the volume");
  auto json = std::make_shared<bool>(false);
  app->add_flag("--json", *json, "Print JSON");
  return {app, [json] { return run(*json); }, {}, {}, {}};
}

}  // namespace palpate::app
