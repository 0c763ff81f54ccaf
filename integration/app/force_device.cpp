#include "integration/app/force_device.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "integration/app/option_checks.h"
#include "integration/app/touch.h"
#include "integration/devices/force_devices.h"
#include "integration/devices/simulated_paths.h"

namespace palpate::app {
namespace {

constexpr int kTimesWhileWaiting = 100;

constexpr double kArm_m = 1.0;  // a controller is felt so far around the scene
// Frames of 11 ms are joined, real movements are not held back; below what the guards damp.
constexpr double kControllerSettle_per_s = 150.0, kControllerSpeed_m_per_s = 1.4;

constexpr double kMouseStart = 0.9;  // of the reach, towards the person: before all there is

Result<OpenedDevice> simulated(const ForceDeviceChoice& choice, LoadedScene& scene, bool fit,
                               std::string why) {
  auto options = simulated_options(choice);
  if (!options) return options.error();
  const DeviceInfo info = devices::info_of(*options);
  // Before a place to touch is looked for: it is where the data are then.
  if (fit) fit_to_reach(scene, info);
  const auto touch = place_to_touch(scene, info);
  devices::PathPlace place;
  if (touch) {
    place = *touch;
  } else {
    // Nothing to press: the hand goes round in the middle of what there is.
    place.surface_m = info.workspace_centre_m;
    place.reach_m = 0.4 * info.workspace_radius_m;
    place.depth_m = 0.0;
    place.clearance_m = 0.2 * info.workspace_radius_m;
    place.times = 2;
  }
  const bool circle = !touch && choice.path == "press";
  const std::string name = circle ? "circle" : choice.path;
  const auto once = devices::path_named(name, place);
  if (!once) return once.error();
  // While motion is awaited the hand goes on.
  if (!scene.missing.empty()) place.times = kTimesWhileWaiting;
  const auto path = devices::path_named(name, place);
  if (!path) return path.error();
  options->path = *path;
  OpenedDevice opened;
  opened.why = fmt::format("{} {}", why,
                           circle ? "Its hand goes round in circles: there is no surface to press."
                                  : fmt::format("Its hand follows the path '{}'.", choice.path));
  opened.simulated = true;
  opened.path_s = once->duration_s();
  opened.device = std::make_unique<devices::SimulatedDevice>(std::move(*options));
  return opened;
}

OpenedDevice mouse(std::string why) {
  desktop::MouseProbeOptions options;
  options.start_m = {0.0, 0.0, kMouseStart * options.workspace_radius_m};
  auto probe = std::make_unique<desktop::MouseProbe>(options);
  OpenedDevice opened;
  opened.mouse = probe.get();
  opened.device = std::move(probe);
  opened.why = std::move(why);
  return opened;
}

/// A hand in the world, at its true size: its device space is the world around the scene.
desktop::MouseProbeOptions in_true_size(const std::string& kind) {
  desktop::MouseProbeOptions options;
  options.kind = kind;
  options.waits = true;
  options.workspace_radius_m = kArm_m;
  options.speed_m_per_s = kControllerSpeed_m_per_s;
  return options;
}

OpenedDevice controller(std::string why) {
  desktop::MouseProbeOptions options = in_true_size("controller");
  options.settle_per_s = kControllerSettle_per_s;
  auto probe = std::make_unique<desktop::MouseProbe>(options);
  OpenedDevice opened;
  opened.controller = probe.get();
  opened.device = std::move(probe);
  opened.why = std::move(why);
  return opened;
}

/// Trackers send some ten places a second: followed as slowly as a mouse.
OpenedDevice tool() {
  auto probe = std::make_unique<desktop::MouseProbe>(in_true_size("tool"));
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

Result<devices::SimulatedOptions> simulated_options(const ForceDeviceChoice& choice) {
  devices::SimulatedOptions options;
  options.real_time = true;
  options.lets_go_at_s = choice.lets_go_at_s;
  if (choice.hand == "human")
    options.body.hand = devices::kHumanHand;
  else if (choice.hand == "loose")
    options.body.hand = devices::kLooseHand;
  else if (choice.hand == "firm")
    options.body.hand = devices::kFirmHand;
  else if (choice.hand == "none")
    options.body.hand = devices::kNoHand;
  else
    return Error{
        ErrorKind::kBadInput,
        fmt::format("There is no hand '{}': choose one of human, loose, firm, none", choice.hand)};
  return options;
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
    // A probe that nobody moves, out of the way.
    OpenedDevice opened;
    desktop::MouseProbeOptions options;
    options.kind = "none";
    options.start_m = {0.0, 0.0, kMouseStart * options.workspace_radius_m};
    opened.device = std::make_unique<desktop::MouseProbe>(options);
    opened.why = "none: it is only looked at.";
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
