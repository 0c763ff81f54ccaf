#pragma once

#include <string>
#include <vector>

#include "module/xr/instance.h"

namespace palpate::xr {

/// Second in the life cycle: the headset that the runtime drives. A value.
struct System {
  XrSystemId id = XR_NULL_SYSTEM_ID;
  std::string name;
  /// PRIMARY_STEREO, or PRIMARY_QUAD_VARJO where the headset has it: a second pair of views in the
  /// middle of the first one, with more pixels per angle.
  XrViewConfigurationType view_type = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;
  /// Recommended and largest sizes, as HeadsetFrame::eyes.
  std::vector<XrViewConfigurationView> views;
  /// The same while the second pair follows the gaze; empty where it never does.
  std::vector<XrViewConfigurationView> gaze_views;
  std::vector<XrEnvironmentBlendMode> blend_modes;  ///< in the runtime's order of preference
  uint32_t max_width = 0, max_height = 0;           ///< of a swapchain
  bool hand_tracking = false;                       ///< hands are seen without controllers

  /// kNoHeadset while it is off; kUnsupported without a view for each eye.
  static Outcome<System> find(const Instance& instance);
};

}  // namespace palpate::xr
