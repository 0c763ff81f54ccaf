#include "module/xr/instance.h"

#include <algorithm>
#include <cstring>
#include <vector>

namespace palpate::xr {
namespace {

Outcome<std::vector<XrExtensionProperties>> offered_extensions() {
  constexpr const char* kCall = "xrEnumerateInstanceExtensionProperties";
  uint32_t count = 0;
  XrResult result = xrEnumerateInstanceExtensionProperties(nullptr, 0, &count, nullptr);
  if (XR_FAILED(result)) return problem_of(kCall, result);
  std::vector<XrExtensionProperties> offered(count, {XR_TYPE_EXTENSION_PROPERTIES});
  result = xrEnumerateInstanceExtensionProperties(nullptr, count, &count, offered.data());
  if (XR_FAILED(result)) return problem_of(kCall, result);
  offered.resize(count);
  return offered;
}

bool offers(const std::vector<XrExtensionProperties>& offered, const char* name) {
  return std::any_of(offered.begin(), offered.end(), [&](const XrExtensionProperties& extension) {
    return std::strcmp(extension.extensionName, name) == 0;
  });
}

template <class Function>
Done load(XrInstance instance, const char* name, Function& function) {
  return done(
      "xrGetInstanceProcAddr",
      xrGetInstanceProcAddr(instance, name, reinterpret_cast<PFN_xrVoidFunction*>(&function)));
}

}  // namespace

Outcome<Instance> Instance::make(bool overlay) {
  const auto offered = offered_extensions();
  if (!offered) return offered.error();
  if (!offers(*offered, XR_KHR_VULKAN_ENABLE2_EXTENSION_NAME)) {
    return Problem{Trouble::kUnsupported,
                   "The OpenXR runtime lacks XR_KHR_vulkan_enable2, without which palpate can not "
                   "draw for it: choose another runtime with XR_RUNTIME_JSON.",
                   "xrEnumerateInstanceExtensionProperties", XR_ERROR_EXTENSION_NOT_PRESENT};
  }
  if (overlay && !offers(*offered, XR_EXTX_OVERLAY_EXTENSION_NAME)) {
    return Problem{Trouble::kUnsupported,
                   "The OpenXR runtime can not show palpate above another program, it lacks "
                   "XR_EXTX_overlay: use one that has it, as Monado and WiVRn do, or run palpate "
                   "without an overlay.",
                   "xrEnumerateInstanceExtensionProperties", XR_ERROR_EXTENSION_NOT_PRESENT};
  }
  std::vector<const char*> wanted{XR_KHR_VULKAN_ENABLE2_EXTENSION_NAME};
  if (overlay) wanted.push_back(XR_EXTX_OVERLAY_EXTENSION_NAME);
  const auto want = [&](const char* name) {
    if (!offers(*offered, name)) return false;
    wanted.push_back(name);
    return true;
  };
  Instance made;
  made.depth_layer_ = want(XR_KHR_COMPOSITION_LAYER_DEPTH_EXTENSION_NAME);
  const bool mask = want(XR_KHR_VISIBILITY_MASK_EXTENSION_NAME);
  const bool clock = want(kTimeExtension);
  const bool hands = want(XR_EXT_HAND_TRACKING_EXTENSION_NAME);
  const bool rates = want(XR_FB_DISPLAY_REFRESH_RATE_EXTENSION_NAME);
  made.hand_interaction_ = want(kHandInteractionExtension);
  made.quad_views_ = want(XR_VARJO_QUAD_VIEWS_EXTENSION_NAME);
  made.foveation_ = made.quad_views_ && want(XR_VARJO_FOVEATED_RENDERING_EXTENSION_NAME);
  const bool models = offers(*offered, kUuidExtension) && offers(*offered, kRenderModelExtension) &&
                      want(kInteractionRenderModelExtension);
  if (models) wanted.insert(wanted.end(), {kUuidExtension, kRenderModelExtension});
  want(kLocalFloorExtension);  // its space is one of those that xrEnumerateReferenceSpaces gives

  XrInstanceCreateInfo create{XR_TYPE_INSTANCE_CREATE_INFO};
  std::strncpy(create.applicationInfo.applicationName, "palpate", XR_MAX_APPLICATION_NAME_SIZE - 1);
  create.applicationInfo.applicationVersion = 1;
  // 1.0 of any patch level: runtimes of 1.1 take it too.
  create.applicationInfo.apiVersion = XR_MAKE_VERSION(1, 0, 0);
  create.enabledExtensionCount = uint32_t(wanted.size());
  create.enabledExtensionNames = wanted.data();
  const Done created = done("xrCreateInstance", xrCreateInstance(&create, made.handle_.out()));
  if (!created) return created.error();

  XrInstanceProperties properties{XR_TYPE_INSTANCE_PROPERTIES};
  const Done told =
      done("xrGetInstanceProperties", xrGetInstanceProperties(made.handle(), &properties));
  if (!told) return told.error();
  made.runtime_ = std::string(properties.runtimeName) + " " +
                  std::to_string(XR_VERSION_MAJOR(properties.runtimeVersion)) + "." +
                  std::to_string(XR_VERSION_MINOR(properties.runtimeVersion)) + "." +
                  std::to_string(XR_VERSION_PATCH(properties.runtimeVersion));
  Done loaded = made.load_functions(clock, mask, hands, rates);
  if (loaded && models) loaded = made.load_models();
  if (!loaded) return loaded.error();
  return made;
}

Done Instance::load_functions(bool clock, bool mask, bool hands, bool rates) {
  Done loaded = load(handle(), "xrGetVulkanGraphicsRequirements2KHR", get_vulkan_requirements);
  if (loaded) loaded = load(handle(), "xrCreateVulkanInstanceKHR", create_vulkan_instance);
  if (loaded) loaded = load(handle(), "xrGetVulkanGraphicsDevice2KHR", get_vulkan_device);
  if (loaded) loaded = load(handle(), "xrCreateVulkanDeviceKHR", create_vulkan_device);
  if (loaded && clock) loaded = load(handle(), kTimeCall, convert_time);
  if (loaded && mask) loaded = load(handle(), "xrGetVisibilityMaskKHR", get_visibility_mask);
  if (loaded && hands) loaded = load(handle(), "xrDestroyHandTrackerEXT", destroy_hand_tracker);
  if (loaded && hands) loaded = load(handle(), "xrLocateHandJointsEXT", locate_hand_joints);
  if (loaded && hands) loaded = load(handle(), "xrCreateHandTrackerEXT", create_hand_tracker);
  if (loaded && rates)
    loaded = load(handle(), "xrEnumerateDisplayRefreshRatesFB", enumerate_refresh_rates);
  if (loaded && rates) loaded = load(handle(), "xrGetDisplayRefreshRateFB", get_refresh_rate);
  if (loaded && rates)
    loaded = load(handle(), "xrRequestDisplayRefreshRateFB", request_refresh_rate);
  return loaded;
}

Done Instance::load_models() {
  ModelFunctions& f = models;
  Done loaded = load(handle(), "xrCreateRenderModelEXT", f.create);
  if (loaded) loaded = load(handle(), "xrDestroyRenderModelEXT", f.destroy);
  if (loaded) loaded = load(handle(), "xrGetRenderModelPropertiesEXT", f.get_properties);
  if (loaded) loaded = load(handle(), "xrCreateRenderModelSpaceEXT", f.create_space);
  if (loaded) loaded = load(handle(), "xrGetRenderModelStateEXT", f.get_state);
  if (loaded) loaded = load(handle(), "xrCreateRenderModelAssetEXT", f.create_asset);
  if (loaded) loaded = load(handle(), "xrDestroyRenderModelAssetEXT", f.destroy_asset);
  if (loaded) loaded = load(handle(), "xrGetRenderModelAssetDataEXT", f.get_asset_data);
  if (loaded) loaded = load(handle(), "xrGetRenderModelAssetPropertiesEXT", f.get_asset_properties);
  if (loaded) loaded = load(handle(), "xrEnumerateInteractionRenderModelIdsEXT", f.enumerate_ids);
  return loaded;
}

Outcome<bool> Instance::next_event(XrEventDataBuffer& event) const {
  event.type = XR_TYPE_EVENT_DATA_BUFFER;
  event.next = nullptr;
  const XrResult result = xrPollEvent(handle(), &event);
  if (XR_FAILED(result)) return problem_of("xrPollEvent", result);
  return result != XR_EVENT_UNAVAILABLE;
}

Outcome<XrPath> Instance::path(const char* text) const {
  XrPath made = XR_NULL_PATH;
  const XrResult result = xrStringToPath(handle(), text, &made);
  if (XR_FAILED(result)) return problem_of("xrStringToPath", result);
  return made;
}

}  // namespace palpate::xr
