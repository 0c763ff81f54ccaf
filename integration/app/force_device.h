#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "integration/loading/load_scene.h"
#include "module/haptics/device.h"
#include "module/haptics/servo/position_source.h"
#include "module/haptics/servo/servo_clock.h"

namespace palpate::app {

/// The choice of a force device on the command line.
struct ForceDeviceChoice {
  /// auto, controller, mouse, simulated, one of devices::force_device_kinds(), which may be
  /// followed by '@' and an address; tool: something else moves it; none: viewing only
  std::string device = "auto";
  std::filesystem::path falcon_firmware;  ///< the user's own file
  std::string hand = "human";             ///< simulated: human, loose, firm, none
  std::string path = "press";             ///< simulated: a named path or a file
  bool real_time = true;                  ///< a thread of the device may ask for real-time priority
  bool has_window = false;                ///< a mouse can be the hand
  bool has_headset = false;               ///< a controller can be the hand
  double lets_go_at_s = std::numeric_limits<double>::infinity();
  ServoClock* clock = nullptr;  ///< simulated: whose time it has; null: the monotonic clock
};

struct OpenedDevice {
  std::unique_ptr<ForceDevice> device;
  std::string why;  ///< which device was opened, and why: a sentence
  bool simulated = false;
  PositionSource* mouse = nullptr;       ///< the device, if it is a mouse; moved by the window
  PositionSource* controller = nullptr;  ///< likewise; moved in the headset
  PositionSource* tool = nullptr;        ///< likewise; moved by a tracker
  double path_s = 0.0;                   ///< simulated: duration of the hand's path
};

/// Errors: kBadInput, with a sentence, if no device could ever satisfy the choice.
Status check_choice(const ForceDeviceChoice& choice);

/// The valid values of --device: "auto", the kinds of real devices, and `others`. Kinds that can
/// have an address may be followed by one.
CLI::Validator a_force_device(std::vector<std::string> others);

/// "Plug in a Novint Falcon, ...": advice for a user without a force device.
std::string devices_that_would_do();

/// Opens a real device: the one that was asked for, or the first kind that answers within a second;
/// null if there is none. Errors: kBadInput.
Result<std::unique_ptr<ForceDevice>> find_force_device(const ForceDeviceChoice& choice);

/// Opens the device of find_force_device(); else a controller if there is a headset, the mouse if
/// there is a window, or the simulated device with a path that touches the scene. fit: first scale
/// the scene to the device's reach, see fit_to_reach(); for a tracked tool it keeps its true size.
/// Errors: kBadInput with one sentence.
Result<OpenedDevice> open_force_device(const ForceDeviceChoice& choice, LoadedScene& scene,
                                       bool fit);

}  // namespace palpate::app
