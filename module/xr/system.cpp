#include "module/xr/system.h"

#include <algorithm>

namespace palpate::xr {
namespace {

Done find_view_type(const Instance& instance, System& system) {
  if (!instance.has_quad_views()) return Nothing{};
  constexpr const char* kCall = "xrEnumerateViewConfigurations";
  uint32_t count = 0;
  XrResult result = xrEnumerateViewConfigurations(instance.handle(), system.id, 0, &count, nullptr);
  if (XR_FAILED(result)) return problem_of(kCall, result);
  std::vector<XrViewConfigurationType> offered(count);
  result =
      xrEnumerateViewConfigurations(instance.handle(), system.id, count, &count, offered.data());
  if (XR_FAILED(result)) return problem_of(kCall, result);
  offered.resize(count);
  constexpr XrViewConfigurationType kQuad = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_QUAD_VARJO;
  if (std::find(offered.begin(), offered.end(), kQuad) != offered.end()) system.view_type = kQuad;
  return Nothing{};
}

Done find_views(const Instance& instance, bool follows_gaze, System& system) {
  constexpr const char* kCall = "xrEnumerateViewConfigurationViews";
  uint32_t count = 0;
  XrResult result = xrEnumerateViewConfigurationViews(instance.handle(), system.id,
                                                      system.view_type, 0, &count, nullptr);
  if (XR_FAILED(result)) return problem_of(kCall, result);
  const uint32_t wanted = system.view_type == XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO ? 2U : 4U;
  if (count != wanted) {
    return Problem{Trouble::kUnsupported,
                   "The headset has " + std::to_string(count) + " views where OpenXR demands " +
                       std::to_string(wanted) + ".",
                   kCall, XR_SUCCESS};
  }
  system.views.assign(count, {XR_TYPE_VIEW_CONFIGURATION_VIEW});
  result = xrEnumerateViewConfigurationViews(instance.handle(), system.id, system.view_type, count,
                                             &count, system.views.data());
  if (XR_FAILED(result) || !follows_gaze) return done(kCall, result);
  XrFoveatedViewConfigurationViewVARJO foveated{XR_TYPE_FOVEATED_VIEW_CONFIGURATION_VIEW_VARJO};
  foveated.foveatedRenderingActive = XR_TRUE;
  std::vector<XrFoveatedViewConfigurationViewVARJO> chained(count, foveated);
  system.gaze_views.assign(count, {XR_TYPE_VIEW_CONFIGURATION_VIEW});
  for (size_t view = 0; view < count; ++view) system.gaze_views[view].next = &chained[view];
  result = xrEnumerateViewConfigurationViews(instance.handle(), system.id, system.view_type, count,
                                             &count, system.gaze_views.data());
  for (XrViewConfigurationView& view : system.gaze_views) view.next = nullptr;
  return done(kCall, result);
}

Done find_blend_modes(const Instance& instance, System& system) {
  constexpr const char* kCall = "xrEnumerateEnvironmentBlendModes";
  uint32_t count = 0;
  XrResult result = xrEnumerateEnvironmentBlendModes(instance.handle(), system.id, system.view_type,
                                                     0, &count, nullptr);
  if (XR_FAILED(result)) return problem_of(kCall, result);
  system.blend_modes.resize(count);
  result = xrEnumerateEnvironmentBlendModes(instance.handle(), system.id, system.view_type, count,
                                            &count, system.blend_modes.data());
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

  // Asked for apart: the validation layer of OpenXR 1.0.20 takes no two structures in a chain.
  XrSystemFoveatedRenderingPropertiesVARJO foveation{
      XR_TYPE_SYSTEM_FOVEATED_RENDERING_PROPERTIES_VARJO};
  if (instance.has_foveation()) {
    properties = {XR_TYPE_SYSTEM_PROPERTIES, &foveation};
    asked = done("xrGetSystemProperties",
                 xrGetSystemProperties(instance.handle(), system.id, &properties));
    if (!asked) return asked.error();
  }

  asked = find_view_type(instance, system);
  const bool follows_gaze = foveation.supportsFoveatedRendering == XR_TRUE &&
                            system.view_type != XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;
  if (asked) asked = find_views(instance, follows_gaze, system);
  if (asked) asked = find_blend_modes(instance, system);
  if (!asked) return asked.error();
  return system;
}

}  // namespace palpate::xr
