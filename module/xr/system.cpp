#include "module/xr/system.h"

namespace palpate::xr {
namespace {

Done find_views(const Instance& instance, System& system) {
  uint32_t count = 0;
  XrResult result =
      xrEnumerateViewConfigurationViews(instance.handle(), system.id, kStereo, 0, &count, nullptr);
  if (XR_FAILED(result)) return problem_of("xrEnumerateViewConfigurationViews", result);
  if (count != system.views.size()) {
    return Problem{Trouble::kUnsupported,
                   "The headset has " + std::to_string(count) + " views, palpate draws two.",
                   "xrEnumerateViewConfigurationViews", XR_SUCCESS};
  }
  system.views.fill({XR_TYPE_VIEW_CONFIGURATION_VIEW});
  result = xrEnumerateViewConfigurationViews(instance.handle(), system.id, kStereo, count, &count,
                                             system.views.data());
  return done("xrEnumerateViewConfigurationViews", result);
}

Done find_blend_modes(const Instance& instance, System& system) {
  constexpr const char* kCall = "xrEnumerateEnvironmentBlendModes";
  uint32_t count = 0;
  XrResult result =
      xrEnumerateEnvironmentBlendModes(instance.handle(), system.id, kStereo, 0, &count, nullptr);
  if (XR_FAILED(result)) return problem_of(kCall, result);
  system.blend_modes.resize(count);
  result = xrEnumerateEnvironmentBlendModes(instance.handle(), system.id, kStereo, count, &count,
                                            system.blend_modes.data());
  if (XR_FAILED(result)) return problem_of(kCall, result);
  system.blend_modes.resize(count);
  if (system.blend_modes.empty()) {
    return Problem{Trouble::kUnsupported, "The OpenXR runtime offers no blend mode.", kCall,
                   XR_SUCCESS};
  }
  return Nothing{};
}

}  // namespace

Outcome<System> System::find(const Instance& instance) {
  System system;
  XrSystemGetInfo get{XR_TYPE_SYSTEM_GET_INFO};
  get.formFactor = XR_FORM_FACTOR_HEAD_MOUNTED_DISPLAY;
  Done asked = done("xrGetSystem", xrGetSystem(instance.handle(), &get, &system.id));
  if (!asked) return asked.error();

  XrSystemHandTrackingPropertiesEXT hands{XR_TYPE_SYSTEM_HAND_TRACKING_PROPERTIES_EXT};
  XrSystemProperties properties{XR_TYPE_SYSTEM_PROPERTIES};
  if (instance.has_hand_tracking()) properties.next = &hands;
  asked = done("xrGetSystemProperties",
               xrGetSystemProperties(instance.handle(), system.id, &properties));
  if (!asked) return asked.error();
  system.name = properties.systemName;
  system.hand_tracking = hands.supportsHandTracking == XR_TRUE;
  system.max_width = properties.graphicsProperties.maxSwapchainImageWidth;
  system.max_height = properties.graphicsProperties.maxSwapchainImageHeight;

  asked = find_views(instance, system);
  if (asked) asked = find_blend_modes(instance, system);
  if (!asked) return asked.error();
  return system;
}

}  // namespace palpate::xr
