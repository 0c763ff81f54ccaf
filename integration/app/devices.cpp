#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "integration/app/commands.h"
#include "integration/app/exit_code.h"
#include "integration/app/session.h"

namespace palpate::app {
namespace {

constexpr const char* kNoDriver =
    "No Vulkan driver was found: install one (Debian: mesa-vulkan-drivers has lavapipe for any "
    "CPU).";

int default_device() {
  const auto context = vulkan::Context::open({});
  return context ? (*context)->info().index : -1;
}

nlohmann::json json_of(const vulkan::DeviceInfo& device, bool is_default) {
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

void print_table(const std::vector<vulkan::DeviceInfo>& devices, int chosen) {
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
    fmt::print("* is used unless --device says otherwise, with a number or part of a name.\n");
}

int run(bool json) {
  const auto devices = vulkan::list_devices();
  const int chosen = default_device();
  if (json) {
    auto list = nlohmann::json::array();
    for (const auto& device : devices) list.push_back(json_of(device, device.index == chosen));
    fmt::print("{}\n", list.dump(2));
  } else if (!devices.empty()) {
    print_table(devices, chosen);
  }
  if (chosen >= 0) return kExitOk;
  fmt::print(stderr, "palpate: {}\n",
             devices.empty() ? kNoDriver : "None of these devices can be used.");
  return kExitBad;
}

}  // namespace

Command add_devices(CLI::App& program) {
  CLI::App* app =
      program.add_subcommand("devices", "List the Vulkan devices and say which is used");
  auto json = std::make_shared<bool>(false);
  app->add_flag("--json", *json, "Print JSON");
  return {app, [json] { return run(*json); }};
}

}  // namespace palpate::app
