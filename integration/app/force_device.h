#pragma once

#include <filesystem>
#include <limits>
#include <memory>
#include <string>

#include "integration/app/felt_scene.h"
#include "integration/desktop/mouse_probe.h"
#include "integration/devices/simulated.h"
#include "module/haptics/device.h"

namespace palpate::app {

/// Which force device, as the command line says it.
struct ForceDeviceChoice {
  std::string device =
      "auto";  ///< auto, falcon, controller, mouse, simulated; none: it is only looked at
  std::filesystem::path falcon_firmware;  ///< the user's own
  std::string hand = "human";             ///< simulated: human, loose, firm, none
  std::string path = "press";             ///< simulated: a made path or a file
  bool has_window = false;                ///< so that a mouse can be the hand
  bool has_headset = false;               ///< so that a controller can
  double lets_go_at_s = std::numeric_limits<double>::infinity();
};

struct OpenedDevice {
  std::unique_ptr<ForceDevice> device;
  std::string why;  ///< which one, and why that one: a sentence
  bool simulated = false;
  desktop::MouseProbe* mouse = nullptr;       ///< the device, if it is that; moved by the window
  desktop::MouseProbe* controller = nullptr;  ///< likewise, moved in the headset
  double path_s = 0.0;                        ///< simulated: how long the hand's path takes
};

/// kBadInput, in a sentence, if the choice can not be met whatever is plugged in.
Status check_choice(const ForceDeviceChoice& choice);

/// The options of the simulated device for a choice; its path is still to be set. kBadInput for an
/// unknown hand.
Result<devices::SimulatedOptions> simulated_options(const ForceDeviceChoice& choice);

/// A Falcon, if it was asked for or one answers within a second; else null. kBadInput.
Result<std::unique_ptr<ForceDevice>> find_falcon(const ForceDeviceChoice& choice);

/// A Falcon if it was asked for, or if one answers within a second and any may be taken; else a
/// controller where there is a headset, the mouse where there is a window, or the simulated device,
/// its hand on a path that touches the scene. kBadInput in one sentence.
Result<OpenedDevice> open_force_device(const ForceDeviceChoice& choice, const FeltScene& scene);

}  // namespace palpate::app
