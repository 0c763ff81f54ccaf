#include "integration/app/force_device.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "integration/app/option_checks.h"
#include "integration/devices/force_devices.h"
#include "integration/running/simulated_hand.h"
#include "integration/running/tool_source.h"

namespace palpate::app {
namespace {

constexpr double kControllerSettle_per_s = 150.0;  // joins frames of 11 ms
constexpr double kMouseStart = 0.9;  // of the reach, towards the person: in front of all data

Result<OpenedDevice> simulated(const ForceDeviceChoice& choice, LoadedScene& scene, bool fit,
                               const std::string& why) {
  auto hand = running::simulated_hand({choice.hand, choice.path, choice.lets_go_at_s, choice.clock},
                                      scene, fit);
  if (!hand) return hand.error();
  OpenedDevice opened;
  opened.why = why + " " + hand->sentence;
  opened.simulated = true;
  opened.path_s = hand->path_s;
  opened.device = std::move(hand->device);
  return opened;
}

OpenedDevice mouse(std::string why) {
  PositionSourceOptions options;
  options.start_m = {0.0, 0.0, kMouseStart * options.workspace_radius_m};
  auto probe = std::make_unique<PositionSource>(options);
  OpenedDevice opened;
  opened.mouse = probe.get();
  opened.device = std::move(probe);
  opened.why = std::move(why);
  return opened;
}

OpenedDevice controller(std::string why) {
  // Like a tracked tool, in true size, but with 90 or more positions a second.
  PositionSourceOptions options = running::tool_probe();
  options.kind = "controller";
  options.settle_per_s = kControllerSettle_per_s;
  auto probe = std::make_unique<PositionSource>(options);
  OpenedDevice opened;
  opened.controller = probe.get();
  opened.device = std::move(probe);
  opened.why = std::move(why);
  return opened;
}

OpenedDevice tool() {
  auto probe = std::make_unique<PositionSource>(running::tool_probe());
  OpenedDevice opened;
  opened.tool = probe.get();
  opened.device = std::move(probe);
  opened.why = "tracked tool, as asked; it gives no force.";
  return opened;
}

}  // namespace

Status check_choice(const ForceDeviceChoice& choice) {
  if (choice.device == "controller" && !choice.has_headset)
    return Error{
        ErrorKind::kBadInput,
        "A controller can be the hand only where there is a headset: add --headset openxr"};
  if (choice.device != "mouse" || choice.has_window) return Nothing{};
  return Error{ErrorKind::kBadInput,
               "A mouse can be the hand only where there is a window: add --headset none"};
}

CLI::Validator a_force_device(std::vector<std::string> others) {
  std::vector<std::string> words{"auto"};
  for (const auto& kind : devices::force_device_kinds()) words.emplace_back(kind.kind);
  words.insert(words.end(), others.begin(), others.end());
  CLI::Validator known = one_of(words);
  return CLI::Validator(
      [known](std::string& text) {
        const auto [word, place] = devices::force_device_name(text);
        std::string kind = word;
        const std::string wrong = known(kind);
        if (!wrong.empty()) return wrong + "; the Vulkan device is named with --gpu";
        if (text.find('@') == std::string::npos ||
            (devices::force_device_kind(word) && !place.empty()))
          return std::string();
        return fmt::format("'{}': only a real device has a place, as in haply@localhost:10001",
                           text);
      },
      known.get_description());
}

std::string devices_that_would_do() {
  std::vector<std::string> names;
  for (const auto& kind : devices::force_device_kinds()) names.emplace_back(kind.name);
  return fmt::format("a {}", fmt::join(names, ", a "));
}

Result<std::unique_ptr<ForceDevice>> find_force_device(const ForceDeviceChoice& choice) {
  return devices::find_force_device(choice.device,
                                    {"", choice.falcon_firmware.string(), choice.real_time});
}

namespace {

Result<OpenedDevice> opened_for(const ForceDeviceChoice& choice, LoadedScene& scene, bool fit) {
  if (choice.device == "none") {
    // A probe that is never moved, outside the data.
    OpenedDevice opened;
    PositionSourceOptions options;
    options.kind = "none";
    options.start_m = {0.0, 0.0, kMouseStart * options.workspace_radius_m};
    opened.device = std::make_unique<PositionSource>(options);
    opened.why = "none: viewing only.";
    return opened;
  }
  if (choice.device == "simulated")
    return simulated(choice, scene, fit, "simulated device, as asked.");
  if (choice.device == "mouse") return mouse("mouse, as asked; it gives no force.");
  if (choice.device == "tool") return tool();
  if (choice.device == "controller")
    return controller("controller, as asked; vibration says what force it would be.");
  auto device = find_force_device(choice);
  if (!device) return device.error();
  if (!*device) {
    if (choice.has_headset)
      return controller(
          "controller, as no force device is there; vibration says what force it would be.");
    if (choice.has_window) return mouse("mouse, as no force device is there; it gives no force.");
    return simulated(choice, scene, fit, "simulated device, as no force device is there.");
  }
  OpenedDevice opened;
  opened.device = std::move(*device);
  const DeviceInfo info = opened.device->info();
  opened.why = fmt::format("{}{}{}", info.name, info.place.empty() ? "" : ", " + info.place,
                           choice.device == "auto" ? ", which is there." : ", as asked.");
  return opened;
}

}  // namespace

Result<OpenedDevice> open_force_device(const ForceDeviceChoice& choice, LoadedScene& scene,
                                       bool fit) {
  auto opened = opened_for(choice, scene, fit);
  if (opened && fit && !opened->simulated && !opened->tool)
    fit_to_reach(scene, opened->device->info());
  return opened;
}

}  // namespace palpate::app
