#include "integration/app/force_device.h"

#include <fmt/format.h>

#include <thread>

#include "integration/app/touch.h"
#include "integration/devices/falcon.h"
#include "integration/devices/made_paths.h"

namespace palpate::app {
namespace {

constexpr int kTrials = 100;  // of 10 ms: an open device answers in far less

constexpr int kTimesWhileWaiting = 100;

constexpr double kArm_m = 1.0;  // a controller is felt so far around the scene
// Frames of 11 ms are joined, real movements are not held back; below what the guards damp.
constexpr double kControllerSettle_per_s = 150.0, kControllerSpeed_m_per_s = 1.4;

constexpr double kMouseStart = 0.9;  // of the reach, towards the person: before all there is

/// Whether a device is there at all. Its firmware or homing may still be in the way.
bool answers(ForceDevice& device) {
  for (int k = 0; k < kTrials; ++k) {
    const DeviceFault fault = device.exchange({}).fault;
    if (fault != DeviceFault::kNotOpened && fault != DeviceFault::kUnplugged) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

Result<OpenedDevice> simulated(const ForceDeviceChoice& choice, const FeltScene& scene,
                               std::string why) {
  auto options = simulated_options(choice);
  if (!options) return options.error();
  const DeviceInfo info = devices::SimulatedDevice(*options).info();
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
OpenedDevice controller(std::string why) {
  desktop::MouseProbeOptions options;
  options.kind = "controller";
  options.waits = true;
  options.workspace_radius_m = kArm_m;
  options.settle_per_s = kControllerSettle_per_s;
  options.speed_m_per_s = kControllerSpeed_m_per_s;
  auto probe = std::make_unique<desktop::MouseProbe>(options);
  OpenedDevice opened;
  opened.controller = probe.get();
  opened.device = std::move(probe);
  opened.why = std::move(why);
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

Result<std::unique_ptr<ForceDevice>> find_falcon(const ForceDeviceChoice& choice) {
  devices::FalconOptions options;
  options.firmware_file = choice.falcon_firmware.string();
  auto falcon = devices::FalconDevice::make(options);
  if (!falcon) return falcon.error();
  // What is not on the bus is not waited for: it would be a second on the way to the first picture.
  if (choice.device == "auto" && !(devices::FalconDevice::is_plugged_in() && answers(**falcon)))
    return std::unique_ptr<ForceDevice>();
  return std::unique_ptr<ForceDevice>(std::move(*falcon));
}

Result<OpenedDevice> open_force_device(const ForceDeviceChoice& choice, const FeltScene& scene) {
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
  if (choice.device == "simulated") return simulated(choice, scene, "simulated device, as asked.");
  if (choice.device == "mouse") return mouse("mouse, as asked; it gives no force.");
  if (choice.device == "controller")
    return controller("controller, as asked; vibration says what force it would be.");
  auto falcon = find_falcon(choice);
  if (!falcon) return falcon.error();
  const bool none = !*falcon;
  if (none && choice.has_headset)
    return controller(
        "controller, as no Falcon is plugged in; vibration says what force it would be.");
  if (none && choice.has_window)
    return mouse("mouse, as no Falcon is plugged in; it gives no force.");
  if (none) return simulated(choice, scene, "simulated device, as no Falcon is plugged in.");
  OpenedDevice opened;
  opened.device = std::move(*falcon);
  opened.why =
      choice.device == "auto" ? "Novint Falcon, which is plugged in." : "Novint Falcon, as asked.";
  return opened;
}

}  // namespace palpate::app
