// Instances, systems, events, paths and Vulkan set-up.
#include <algorithm>
#include <cstring>

#include "tests/xr/runtime/world.h"

namespace palpate::test::fake {
namespace {

constexpr XrSystemId kSystem = 7;

bool legal_path(const std::string& text) {
  if (text.size() < 2 || text[0] != '/' || text.back() == '/') return false;
  char before = 0;
  for (const char c : text) {
    const bool fine = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
                      c == '.' || c == '/';
    if (!fine || (c == '/' && before == '/')) return false;
    before = c;
  }
  return true;
}

}  // namespace

XrResult xr_EnumerateInstanceExtensionProperties(const char*, uint32_t capacity, uint32_t* count,
                                                 XrExtensionProperties* properties) {
  const Call call("xrEnumerateInstanceExtensionProperties");
  if (call.answered()) return call.answer();
  return enumerate(world().setup().extensions, capacity, count, properties,
                   [](const std::string& from, XrExtensionProperties& to) {
                     std::strncpy(to.extensionName, from.c_str(), XR_MAX_EXTENSION_NAME_SIZE - 1);
                     to.extensionVersion = 1;
                   });
}

XrResult xr_CreateInstance(const XrInstanceCreateInfo* create, XrInstance* made) {
  const Call call("xrCreateInstance");
  if (call.answered()) return call.answer();
  World& w = world();
  if (!w.setup().runtime_up) return XR_ERROR_RUNTIME_FAILURE;
  if (create->type != XR_TYPE_INSTANCE_CREATE_INFO) return w.violation("xrCreateInstance: type");
  if (XR_VERSION_MAJOR(create->applicationInfo.apiVersion) != 1)
    return XR_ERROR_API_VERSION_UNSUPPORTED;
  if (!create->applicationInfo.applicationName[0])
    return w.violation("xrCreateInstance: no name", XR_ERROR_NAME_INVALID);
  for (const auto& [id, object] : w.objects)
    if (object->kind == Kind::kInstance)
      return w.violation("xrCreateInstance: a second one", XR_ERROR_LIMIT_REACHED);
  std::set<std::string> wanted;
  for (uint32_t i = 0; i < create->enabledExtensionCount; ++i) {
    const std::string extension = create->enabledExtensionNames[i];
    const auto& known = w.setup().extensions;
    if (std::find(known.begin(), known.end(), extension) == known.end())
      return w.violation("xrCreateInstance: " + extension, XR_ERROR_EXTENSION_NOT_PRESENT);
    wanted.insert(extension);
  }
  Instance& instance = w.add<Instance>(Kind::kInstance, 0);
  instance.extensions = wanted;
  w.events.clear();
  *made = handle_of<XrInstance>(instance.id);
  return XR_SUCCESS;
}

XrResult xr_DestroyInstance(XrInstance handle) {
  const Call call("xrDestroyInstance", handle);
  if (!call.instance) return call.answer();
  world().remove(call.instance->id);
  world().write_report();
  return XR_SUCCESS;
}

XrResult xr_GetInstanceProperties(XrInstance handle, XrInstanceProperties* properties) {
  const Call call("xrGetInstanceProperties", handle);
  if (call.answered()) return call.answer();
  properties->runtimeVersion = XR_MAKE_VERSION(0, 1, 0);
  std::strcpy(properties->runtimeName, "palpate's test runtime");
  return XR_SUCCESS;
}

XrResult xr_PollEvent(XrInstance handle, XrEventDataBuffer* event) {
  const Call call("xrPollEvent", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  if (event->type != XR_TYPE_EVENT_DATA_BUFFER) return w.violation("xrPollEvent: type not reset");
  if (w.events.empty()) return XR_EVENT_UNAVAILABLE;
  *event = w.events.front();
  w.events.pop_front();
  if (event->type == XR_TYPE_EVENT_DATA_INSTANCE_LOSS_PENDING) call.instance->lost = true;
  return XR_SUCCESS;
}

XrResult xr_ResultToString(XrInstance, XrResult value, char* text) {
  std::snprintf(text, XR_MAX_RESULT_STRING_SIZE, "XR_RESULT_%d", int(value));
  return XR_SUCCESS;
}

XrResult xr_StructureTypeToString(XrInstance, XrStructureType value, char* text) {
  std::snprintf(text, XR_MAX_STRUCTURE_NAME_SIZE, "XR_TYPE_%d", int(value));
  return XR_SUCCESS;
}

XrResult xr_GetSystem(XrInstance handle, const XrSystemGetInfo* get, XrSystemId* system) {
  const Call call("xrGetSystem", handle);
  if (call.answered()) return call.answer();
  if (get->formFactor != XR_FORM_FACTOR_HEAD_MOUNTED_DISPLAY)
    return XR_ERROR_FORM_FACTOR_UNSUPPORTED;
  if (!world().setup().headset_on) return XR_ERROR_FORM_FACTOR_UNAVAILABLE;
  call.instance->asked_system = true;
  *system = kSystem;
  return XR_SUCCESS;
}

static std::optional<XrResult> bad_system(const char* function, const Call& call, XrSystemId id) {
  if (call.answered()) return call.answer();
  if (id != kSystem || !call.instance->asked_system)
    return world().violation(std::string(function) + ": system", XR_ERROR_SYSTEM_INVALID);
  return std::nullopt;
}

XrResult xr_GetSystemProperties(XrInstance handle, XrSystemId id, XrSystemProperties* properties) {
  const Call call("xrGetSystemProperties", handle);
  if (const auto bad = bad_system("xrGetSystemProperties", call, id)) return *bad;
  properties->systemId = id;
  properties->vendorId = 42;
  std::strcpy(properties->systemName, "made headset");
  properties->graphicsProperties = {8192, 8192, 16};
  properties->trackingProperties = {XR_TRUE, XR_TRUE};
  const auto has = [&](const char* extension) {
    return call.instance->extensions.count(extension) > 0;
  };
  for (auto* next = static_cast<XrBaseOutStructure*>(properties->next); next; next = next->next) {
    if (next->type == XR_TYPE_SYSTEM_HAND_TRACKING_PROPERTIES_EXT &&
        has(XR_EXT_HAND_TRACKING_EXTENSION_NAME))
      reinterpret_cast<XrSystemHandTrackingPropertiesEXT*>(next)->supportsHandTracking =
          world().setup().sees_hands;
    else if (next->type == XR_TYPE_SYSTEM_FOVEATED_RENDERING_PROPERTIES_VARJO &&
             has(XR_VARJO_FOVEATED_RENDERING_EXTENSION_NAME))
      reinterpret_cast<XrSystemFoveatedRenderingPropertiesVARJO*>(next)->supportsFoveatedRendering =
          world().follows_gaze();
    else
      return world().violation("xrGetSystemProperties: chain");
  }
  return XR_SUCCESS;
}

XrResult xr_EnumerateViewConfigurations(XrInstance handle, XrSystemId id, uint32_t capacity,
                                        uint32_t* count, XrViewConfigurationType* types) {
  const Call call("xrEnumerateViewConfigurations", handle);
  if (const auto bad = bad_system("xrEnumerateViewConfigurations", call, id)) return *bad;
  return enumerate(world().view_types(), capacity, count, types,
                   [](auto from, auto& to) { to = from; });
}

XrResult xr_GetViewConfigurationProperties(XrInstance handle, XrSystemId id,
                                           XrViewConfigurationType type,
                                           XrViewConfigurationProperties* properties) {
  const Call call("xrGetViewConfigurationProperties", handle);
  if (const auto bad = bad_system("xrGetViewConfigurationProperties", call, id)) return *bad;
  properties->viewConfigurationType = type;
  properties->fovMutable = XR_FALSE;
  return XR_SUCCESS;
}

XrResult xr_EnumerateViewConfigurationViews(XrInstance handle, XrSystemId id,
                                            XrViewConfigurationType type, uint32_t capacity,
                                            uint32_t* count, XrViewConfigurationView* views) {
  const Call call("xrEnumerateViewConfigurationViews", handle);
  if (const auto bad = bad_system("xrEnumerateViewConfigurationViews", call, id)) return *bad;
  const std::vector<XrViewConfigurationType> offered = world().view_types();
  if (std::find(offered.begin(), offered.end(), type) == offered.end())
    return XR_ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED;
  const Setup& setup = world().setup();
  XrViewConfigurationView view{XR_TYPE_VIEW_CONFIGURATION_VIEW};
  view.recommendedImageRectWidth = setup.view_width;
  view.recommendedImageRectHeight = setup.view_height;
  view.maxImageRectWidth = view.maxImageRectHeight = 4096;
  view.recommendedSwapchainSampleCount = view.maxSwapchainSampleCount = 1;
  std::vector<XrViewConfigurationView> all{view, view};
  if (type == XR_VIEW_CONFIGURATION_TYPE_PRIMARY_QUAD_VARJO) {
    const auto* chained =
        capacity > 2 ? static_cast<const XrFoveatedViewConfigurationViewVARJO*>(views[2].next)
                     : nullptr;
    if (chained && (chained->type != XR_TYPE_FOVEATED_VIEW_CONFIGURATION_VIEW_VARJO ||
                    !world().follows_gaze()))
      return world().violation("xrEnumerateViewConfigurationViews: chain");
    const bool gaze = chained && chained->foveatedRenderingActive == XR_TRUE;
    view.recommendedImageRectWidth = gaze ? setup.gaze_width : setup.focus_width;
    view.recommendedImageRectHeight = gaze ? setup.gaze_height : setup.focus_height;
    all.insert(all.end(), {view, view});
  }
  bool typed = true;
  const XrResult result = enumerate(all, capacity, count, views, [&](const auto& from, auto& to) {
    typed = typed && to.type == XR_TYPE_VIEW_CONFIGURATION_VIEW;
    void* const next = to.next;
    to = from;
    to.next = next;
  });
  return typed ? result : world().violation("xrEnumerateViewConfigurationViews: type");
}

XrResult xr_EnumerateEnvironmentBlendModes(XrInstance handle, XrSystemId id,
                                           XrViewConfigurationType, uint32_t capacity,
                                           uint32_t* count, XrEnvironmentBlendMode* modes) {
  const Call call("xrEnumerateEnvironmentBlendModes", handle);
  if (const auto bad = bad_system("xrEnumerateEnvironmentBlendModes", call, id)) return *bad;
  return enumerate(world().setup().blend_modes, capacity, count, modes,
                   [](auto from, auto& to) { to = from; });
}

XrResult xr_StringToPath(XrInstance handle, const char* text, XrPath* path) {
  const Call call("xrStringToPath", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  const auto known = w.path_numbers.find(text);
  if (known != w.path_numbers.end()) {
    *path = known->second;
    return XR_SUCCESS;
  }
  if (!legal_path(text))
    return w.violation(std::string("xrStringToPath: ") + text, XR_ERROR_PATH_FORMAT_INVALID);
  w.paths.emplace_back(text);
  *path = w.path_numbers[text] = w.paths.size();
  return XR_SUCCESS;
}

XrResult xr_PathToString(XrInstance handle, XrPath path, uint32_t capacity, uint32_t* count,
                         char* text) {
  const Call call("xrPathToString", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  if (path == 0 || path > w.paths.size())
    return w.violation("xrPathToString: no such path", XR_ERROR_PATH_INVALID);
  return copy_text(w.paths[path - 1], capacity, count, text);
}

XrResult xr_ConvertTimeToTimespecTimeKHR(XrInstance handle, XrTime time, timespec* at) {
  const Call call("xrConvertTimeToTimespecTimeKHR", handle);
  if (call.answered()) return call.answer();
  if (time <= 0) return world().violation("xrConvertTimeToTimespecTimeKHR", XR_ERROR_TIME_INVALID);
  const int64_t ns = world().monotonic_of(time);
  at->tv_sec = ns / 1'000'000'000;
  at->tv_nsec = ns % 1'000'000'000;
  return XR_SUCCESS;
}

XrResult xr_GetVulkanGraphicsRequirements2KHR(XrInstance handle, XrSystemId id,
                                              XrGraphicsRequirementsVulkanKHR* needs) {
  const Call call("xrGetVulkanGraphicsRequirements2KHR", handle);
  if (const auto bad = bad_system("xrGetVulkanGraphicsRequirements2KHR", call, id)) return *bad;
  call.instance->asked_requirements = true;
  needs->minApiVersionSupported = XR_MAKE_VERSION(1, world().setup().vulkan_minor, 0);
  needs->maxApiVersionSupported = XR_MAKE_VERSION(1, 3, 0);
  return XR_SUCCESS;
}

XrResult xr_CreateVulkanInstanceKHR(XrInstance handle, const XrVulkanInstanceCreateInfoKHR* create,
                                    VkInstance* made, VkResult* result) {
  const Call call("xrCreateVulkanInstanceKHR", handle);
  if (const auto bad = bad_system("xrCreateVulkanInstanceKHR", call, create->systemId)) return *bad;
  if (!call.instance->asked_requirements) {
    return world().violation("xrCreateVulkanInstanceKHR before the requirements",
                             XR_ERROR_GRAPHICS_REQUIREMENTS_CALL_MISSING);
  }
  const auto vk_create = reinterpret_cast<PFN_vkCreateInstance>(
      create->pfnGetInstanceProcAddr(VK_NULL_HANDLE, "vkCreateInstance"));
  *result = vk_create(create->vulkanCreateInfo, create->vulkanAllocator, made);
  call.instance->made_vulkan = true;
  return XR_SUCCESS;
}

XrResult xr_GetVulkanGraphicsDevice2KHR(XrInstance handle,
                                        const XrVulkanGraphicsDeviceGetInfoKHR* get,
                                        VkPhysicalDevice* device) {
  const Call call("xrGetVulkanGraphicsDevice2KHR", handle);
  if (const auto bad = bad_system("xrGetVulkanGraphicsDevice2KHR", call, get->systemId))
    return *bad;
  if (world().setup().own_vulkan_only && !call.instance->made_vulkan)
    return XR_ERROR_VALIDATION_FAILURE;
  uint32_t count = 1;
  const VkResult found = vkEnumeratePhysicalDevices(get->vulkanInstance, &count, device);
  if ((found != VK_SUCCESS && found != VK_INCOMPLETE) || count == 0)
    return XR_ERROR_RUNTIME_FAILURE;
  call.instance->device = *device;
  return XR_SUCCESS;
}

XrResult xr_CreateVulkanDeviceKHR(XrInstance handle, const XrVulkanDeviceCreateInfoKHR* create,
                                  VkDevice* made, VkResult* result) {
  const Call call("xrCreateVulkanDeviceKHR", handle);
  if (const auto bad = bad_system("xrCreateVulkanDeviceKHR", call, create->systemId)) return *bad;
  if (create->vulkanPhysicalDevice != call.instance->device)
    return world().violation("xrCreateVulkanDeviceKHR: device", XR_ERROR_HANDLE_INVALID);
  *result = vkCreateDevice(create->vulkanPhysicalDevice, create->vulkanCreateInfo,
                           create->vulkanAllocator, made);
  if (*result == VK_SUCCESS) call.instance->made = *made;
  return XR_SUCCESS;
}

}  // namespace palpate::test::fake
