#pragma once

#include <memory>
#include <string>

#include "integration/app/gpu.h"
#include "integration/desktop/desktop_loop.h"
#include "integration/headset/headset_loop.h"

namespace palpate::app {

/// Where a person wants to see what is felt.
struct ViewerChoice {
  std::string headset = "auto";     ///< auto, openxr, none (a window) or off
  bool headless = false;            ///< pictures are written to files
  bool mirror = true;               ///< a window besides the headset, where there is a display
  bool pass_through = false;        ///< the room behind the volume, where the headset can
  std::optional<uint32_t> overlay;  ///< above another program, see xr::HeadsetOptions
  std::string scene_name;
  DeviceOptions gpu;
  ViewChoices view;
};

/// The viewers of a scene that is felt, besides pictures to files.
struct Viewers {
  std::unique_ptr<headset::HeadsetLoop> headset;
  std::unique_ptr<desktop::DesktopLoop> window;
  std::string why;  ///< which, and why: a sentence
};

/// The headset if it is there or was asked for, else a window where there is a display, else none.
/// kNoDevice, in a sentence, if what was asked for can not be had: no display for a window, no
/// OpenXR runtime at all; a headset that is only off is waited for.
Result<Viewers> open_viewers(const ViewerChoice& choice);

}  // namespace palpate::app
