#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "integration/scenes/load_scene.h"
#include "module/haptics/device.h"
#include "module/haptics/position_source.h"

namespace palpate::app {

/// Which force device, as the command line says it.
struct ForceDeviceChoice {
  /// auto, controller, mouse, simulated, one of devices::force_device_kinds(), which may be
  /// followed by '@' and its place; tool: something else moves it; none: it is only looked at
  std::string device = "auto";
  std::filesystem::path falcon_firmware;  ///< the user's own
  std::string hand = "human";             ///< simulated: human, loose, firm, none
  std::string path = "press";             ///< simulated: a named path or a file
  bool real_time = true;                  ///< a thread of the device may ask for priority
  bool has_window = false;                ///< so that a mouse can be the hand
  bool has_headset = false;               ///< so that a controller can
  double lets_go_at_s = std::numeric_limits<double>::infinity();
};

struct OpenedDevice {
  std::unique_ptr<ForceDevice> device;
  std::string why;  ///< which one, and why that one: a sentence
  bool simulated = false;
  PositionSource* mouse = nullptr;       ///< the device, if it is that; moved by the window
  PositionSource* controller = nullptr;  ///< likewise, moved in the headset
  PositionSource* tool = nullptr;        ///< likewise, moved by a tracker
  double path_s = 0.0;                   ///< simulated: how long the hand's path takes
};

/// kBadInput, in a sentence, if the choice can not be met whatever is plugged in.
Status check_choice(const ForceDeviceChoice& choice);

/// What can stand behind --device: "auto", the kinds of real devices, and `others`. With a place
/// after it where a kind can have one.
CLI::Validator a_force_device(std::vector<std::string> others);

/// "Plug in a Novint Falcon, ...": what a user without a force device can do.
std::string devices_that_would_do();

/// A real device: the one that was asked for, or the first kind that answers within a second; else
/// null. kBadInput.
Result<std::unique_ptr<ForceDevice>> find_force_device(const ForceDeviceChoice& choice);

/// What find_force_device() finds; else a controller where there is a headset, the mouse where
/// there is a window, or the simulated device, its hand on a path that touches the scene. fit: the
/// scene is made to fit the device's reach, see fit_to_reach(); for a tracked tool it stays in true
/// size. kBadInput in one sentence.
Result<OpenedDevice> open_force_device(const ForceDeviceChoice& choice, LoadedScene& scene,
                                       bool fit);

}  // namespace palpate::app
