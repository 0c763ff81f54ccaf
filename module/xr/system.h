#pragma once

#include <array>
#include <string>
#include <vector>

#include "module/xr/instance.h"

namespace palpate::xr {

/// Second in the life cycle: the headset that the runtime drives. A value.
struct System {
  XrSystemId id = XR_NULL_SYSTEM_ID;
  std::string name;
  std::array<XrViewConfigurationView, 2> views{};   ///< left, right: recommended and largest sizes
  std::vector<XrEnvironmentBlendMode> blend_modes;  ///< in the runtime's order of preference
  uint32_t max_width = 0, max_height = 0;           ///< of a swapchain
  bool hand_tracking = false;                       ///< hands are seen without controllers

  /// kNoHeadset while it is off; kUnsupported without two views.
  static Outcome<System> find(const Instance& instance);
};

constexpr XrViewConfigurationType kStereo = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;

}  // namespace palpate::xr
