#pragma once

#include <memory>
#include <string>

#include "integration/app/gpu.h"
#include "integration/desktop/desktop_loop.h"
#include "integration/headset/headset_loop.h"

namespace palpate::app {

/// Where the user wants to see the scene.
struct ViewerChoice {
  std::string headset = "auto";     ///< auto, openxr, none (a window) or off
  bool headless = false;            ///< pictures are written to files instead
  bool mirror = true;               ///< a window besides the headset, where there is a display
  bool pass_through = false;        ///< show the room behind the volume if the headset supports it
  std::optional<uint32_t> overlay;  ///< above another OpenXR program, see xr::HeadsetOptions
  bool panel = true;                ///< text and slices in the headset
  double refresh_hz = 0.0;          ///< of the headset's display; 0: what the pictures can hold
  bool calibrated = false;          ///< the place of the force device in the room is known
  std::string scene_name;
  DeviceOptions gpu;
  ViewChoices view;
};

/// The viewers of a running scene, besides pictures in files.
struct Viewers {
  std::unique_ptr<headset::HeadsetLoop> headset;
  std::unique_ptr<desktop::DesktopLoop> window;
  std::string why;  ///< which viewers, and why: a sentence
};

/// Opens the headset if there is one or if it was asked for, else a window if there is a display,
/// else nothing. Errors: kNoDevice, with a sentence, if what was asked for is impossible: no
/// display for a window, no OpenXR runtime. A headset that is switched off is waited for.
Result<Viewers> open_viewers(const ViewerChoice& choice);

}  // namespace palpate::app
