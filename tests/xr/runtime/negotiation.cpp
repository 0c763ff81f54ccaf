// How the loader finds the runtime, and the runtime its functions.
#include <string>
#include <unordered_map>

#include "tests/xr/runtime/models.h"
#include "tests/xr/runtime/negotiation.h"
#include "tests/xr/runtime/world.h"

namespace palpate::test::fake {

XrResult xr_EnumerateInstanceExtensionProperties(const char*, uint32_t capacity, uint32_t* count,
                                                 XrExtensionProperties* properties);
XrResult xr_CreateInstance(const XrInstanceCreateInfo* create, XrInstance* made);
XrResult xr_DestroyInstance(XrInstance handle);
XrResult xr_GetInstanceProperties(XrInstance handle, XrInstanceProperties* properties);
XrResult xr_PollEvent(XrInstance handle, XrEventDataBuffer* event);
XrResult xr_ResultToString(XrInstance, XrResult value, char* text);
XrResult xr_StructureTypeToString(XrInstance, XrStructureType value, char* text);
XrResult xr_GetSystem(XrInstance handle, const XrSystemGetInfo* get, XrSystemId* system);
XrResult xr_GetSystemProperties(XrInstance handle, XrSystemId id, XrSystemProperties* properties);
XrResult xr_EnumerateViewConfigurations(XrInstance handle, XrSystemId id, uint32_t capacity,
                                        uint32_t* count, XrViewConfigurationType* types);
XrResult xr_GetViewConfigurationProperties(XrInstance handle, XrSystemId id,
                                           XrViewConfigurationType type,
                                           XrViewConfigurationProperties* properties);
XrResult xr_EnumerateViewConfigurationViews(XrInstance handle, XrSystemId id,
                                            XrViewConfigurationType type, uint32_t capacity,
                                            uint32_t* count, XrViewConfigurationView* views);
XrResult xr_EnumerateEnvironmentBlendModes(XrInstance handle, XrSystemId id,
                                           XrViewConfigurationType, uint32_t capacity,
                                           uint32_t* count, XrEnvironmentBlendMode* modes);
XrResult xr_StringToPath(XrInstance handle, const char* text, XrPath* path);
XrResult xr_PathToString(XrInstance handle, XrPath path, uint32_t capacity, uint32_t* count,
                         char* text);
XrResult xr_ConvertTimeToTimespecTimeKHR(XrInstance handle, XrTime time, timespec* at);
XrResult xr_GetVulkanGraphicsRequirements2KHR(XrInstance handle, XrSystemId id,
                                              XrGraphicsRequirementsVulkanKHR* needs);
XrResult xr_CreateVulkanInstanceKHR(XrInstance handle, const XrVulkanInstanceCreateInfoKHR* create,
                                    VkInstance* made, VkResult* result);
XrResult xr_GetVulkanGraphicsDevice2KHR(XrInstance handle,
                                        const XrVulkanGraphicsDeviceGetInfoKHR* get,
                                        VkPhysicalDevice* device);
XrResult xr_CreateVulkanDeviceKHR(XrInstance handle, const XrVulkanDeviceCreateInfoKHR* create,
                                  VkDevice* made, VkResult* result);
XrResult xr_CreateSession(XrInstance handle, const XrSessionCreateInfo* create, XrSession* made);
XrResult xr_DestroySession(XrSession handle);
XrResult xr_BeginSession(XrSession handle, const XrSessionBeginInfo* begin);
XrResult xr_EndSession(XrSession handle);
XrResult xr_RequestExitSession(XrSession handle);
XrResult xr_WaitFrame(XrSession handle, const XrFrameWaitInfo*, XrFrameState* state);
XrResult xr_BeginFrame(XrSession handle, const XrFrameBeginInfo*);
XrResult xr_EndFrame(XrSession handle, const XrFrameEndInfo* end);
XrResult xr_LocateViews(XrSession handle, const XrViewLocateInfo* locate, XrViewState* state,
                        uint32_t capacity, uint32_t* count, XrView* views);
XrResult xr_GetVisibilityMaskKHR(XrSession handle, XrViewConfigurationType views, uint32_t view,
                                 XrVisibilityMaskTypeKHR type, XrVisibilityMaskKHR* mask);
XrResult xr_EnumerateReferenceSpaces(XrSession handle, uint32_t capacity, uint32_t* count,
                                     XrReferenceSpaceType* spaces);
XrResult xr_CreateReferenceSpace(XrSession handle, const XrReferenceSpaceCreateInfo* create,
                                 XrSpace* made);
XrResult xr_GetReferenceSpaceBoundsRect(XrSession handle, XrReferenceSpaceType,
                                        XrExtent2Df* bounds);
XrResult xr_CreateActionSpace(XrSession handle, const XrActionSpaceCreateInfo* create,
                              XrSpace* made);
XrResult xr_DestroySpace(XrSpace handle);
XrResult xr_LocateSpace(XrSpace handle, XrSpace base_handle, XrTime time,
                        XrSpaceLocation* location);
XrResult xr_EnumerateSwapchainFormats(XrSession handle, uint32_t capacity, uint32_t* count,
                                      int64_t* formats);
XrResult xr_CreateSwapchain(XrSession handle, const XrSwapchainCreateInfo* create,
                            XrSwapchain* made);
XrResult xr_DestroySwapchain(XrSwapchain handle);
XrResult xr_EnumerateSwapchainImages(XrSwapchain handle, uint32_t capacity, uint32_t* count,
                                     XrSwapchainImageBaseHeader* images);
XrResult xr_AcquireSwapchainImage(XrSwapchain handle, const XrSwapchainImageAcquireInfo*,
                                  uint32_t* index);
XrResult xr_WaitSwapchainImage(XrSwapchain handle, const XrSwapchainImageWaitInfo* wait);
XrResult xr_ReleaseSwapchainImage(XrSwapchain handle, const XrSwapchainImageReleaseInfo*);
XrResult xr_CreateActionSet(XrInstance handle, const XrActionSetCreateInfo* create,
                            XrActionSet* made);
XrResult xr_DestroyActionSet(XrActionSet handle);
XrResult xr_CreateAction(XrActionSet handle, const XrActionCreateInfo* create, XrAction* made);
XrResult xr_DestroyAction(XrAction handle);
XrResult xr_SuggestInteractionProfileBindings(
    XrInstance handle, const XrInteractionProfileSuggestedBinding* suggested);
XrResult xr_AttachSessionActionSets(XrSession handle, const XrSessionActionSetsAttachInfo* attach);
XrResult xr_GetCurrentInteractionProfile(XrSession handle, XrPath user,
                                         XrInteractionProfileState* state);
XrResult xr_SyncActions(XrSession handle, const XrActionsSyncInfo* sync);
XrResult xr_GetActionStateBoolean(XrSession handle, const XrActionStateGetInfo* get,
                                  XrActionStateBoolean* state);
XrResult xr_GetActionStateFloat(XrSession handle, const XrActionStateGetInfo* get,
                                XrActionStateFloat* state);
XrResult xr_GetActionStateVector2f(XrSession handle, const XrActionStateGetInfo* get,
                                   XrActionStateVector2f* state);
XrResult xr_GetActionStatePose(XrSession handle, const XrActionStateGetInfo* get,
                               XrActionStatePose* state);
XrResult xr_EnumerateBoundSourcesForAction(XrSession handle,
                                           const XrBoundSourcesForActionEnumerateInfo* info,
                                           uint32_t capacity, uint32_t* count, XrPath* sources);
XrResult xr_GetInputSourceLocalizedName(XrSession handle,
                                        const XrInputSourceLocalizedNameGetInfo* get,
                                        uint32_t capacity, uint32_t* count, char* text);
XrResult xr_ApplyHapticFeedback(XrSession handle, const XrHapticActionInfo* info,
                                const XrHapticBaseHeader* haptic);
XrResult xr_StopHapticFeedback(XrSession handle, const XrHapticActionInfo* info);
XrResult xr_CreateHandTrackerEXT(XrSession handle, const XrHandTrackerCreateInfoEXT* create,
                                 XrHandTrackerEXT* made);
XrResult xr_DestroyHandTrackerEXT(XrHandTrackerEXT handle);
XrResult xr_LocateHandJointsEXT(XrHandTrackerEXT handle, const XrHandJointsLocateInfoEXT* locate,
                                XrHandJointLocationsEXT* locations);
XrResult xr_EnumerateDisplayRefreshRatesFB(XrSession handle, uint32_t capacity, uint32_t* count,
                                           float* rates);
XrResult xr_GetDisplayRefreshRateFB(XrSession handle, float* rate);
XrResult xr_RequestDisplayRefreshRateFB(XrSession handle, float rate);
XrResult xr_GetInstanceProcAddr(XrInstance instance, const char* name,
                                PFN_xrVoidFunction* function);

namespace {

struct Entry {
  const char* name;
  PFN_xrVoidFunction function;
};
#define PALPATE_ENTRY(name) \
  { "xr" #name, reinterpret_cast<PFN_xrVoidFunction>(&xr_##name) }
const Entry kEntries[] = {
    PALPATE_ENTRY(GetInstanceProcAddr),
    PALPATE_ENTRY(EnumerateInstanceExtensionProperties),
    PALPATE_ENTRY(CreateInstance),
    PALPATE_ENTRY(DestroyInstance),
    PALPATE_ENTRY(GetInstanceProperties),
    PALPATE_ENTRY(PollEvent),
    PALPATE_ENTRY(ResultToString),
    PALPATE_ENTRY(StructureTypeToString),
    PALPATE_ENTRY(GetSystem),
    PALPATE_ENTRY(GetSystemProperties),
    PALPATE_ENTRY(EnumerateViewConfigurations),
    PALPATE_ENTRY(GetViewConfigurationProperties),
    PALPATE_ENTRY(EnumerateViewConfigurationViews),
    PALPATE_ENTRY(EnumerateEnvironmentBlendModes),
    PALPATE_ENTRY(StringToPath),
    PALPATE_ENTRY(PathToString),
    PALPATE_ENTRY(ConvertTimeToTimespecTimeKHR),
    PALPATE_ENTRY(GetVulkanGraphicsRequirements2KHR),
    PALPATE_ENTRY(CreateVulkanInstanceKHR),
    PALPATE_ENTRY(GetVulkanGraphicsDevice2KHR),
    PALPATE_ENTRY(CreateVulkanDeviceKHR),
    PALPATE_ENTRY(CreateSession),
    PALPATE_ENTRY(DestroySession),
    PALPATE_ENTRY(BeginSession),
    PALPATE_ENTRY(EndSession),
    PALPATE_ENTRY(RequestExitSession),
    PALPATE_ENTRY(WaitFrame),
    PALPATE_ENTRY(BeginFrame),
    PALPATE_ENTRY(EndFrame),
    PALPATE_ENTRY(LocateViews),
    PALPATE_ENTRY(GetVisibilityMaskKHR),
    PALPATE_ENTRY(EnumerateReferenceSpaces),
    PALPATE_ENTRY(CreateReferenceSpace),
    PALPATE_ENTRY(GetReferenceSpaceBoundsRect),
    PALPATE_ENTRY(CreateActionSpace),
    PALPATE_ENTRY(DestroySpace),
    PALPATE_ENTRY(LocateSpace),
    PALPATE_ENTRY(EnumerateSwapchainFormats),
    PALPATE_ENTRY(CreateSwapchain),
    PALPATE_ENTRY(DestroySwapchain),
    PALPATE_ENTRY(EnumerateSwapchainImages),
    PALPATE_ENTRY(AcquireSwapchainImage),
    PALPATE_ENTRY(WaitSwapchainImage),
    PALPATE_ENTRY(ReleaseSwapchainImage),
    PALPATE_ENTRY(CreateActionSet),
    PALPATE_ENTRY(DestroyActionSet),
    PALPATE_ENTRY(CreateAction),
    PALPATE_ENTRY(DestroyAction),
    PALPATE_ENTRY(SuggestInteractionProfileBindings),
    PALPATE_ENTRY(AttachSessionActionSets),
    PALPATE_ENTRY(GetCurrentInteractionProfile),
    PALPATE_ENTRY(SyncActions),
    PALPATE_ENTRY(GetActionStateBoolean),
    PALPATE_ENTRY(GetActionStateFloat),
    PALPATE_ENTRY(GetActionStateVector2f),
    PALPATE_ENTRY(GetActionStatePose),
    PALPATE_ENTRY(EnumerateBoundSourcesForAction),
    PALPATE_ENTRY(GetInputSourceLocalizedName),
    PALPATE_ENTRY(ApplyHapticFeedback),
    PALPATE_ENTRY(StopHapticFeedback),
    PALPATE_ENTRY(CreateHandTrackerEXT),
    PALPATE_ENTRY(DestroyHandTrackerEXT),
    PALPATE_ENTRY(LocateHandJointsEXT),
    PALPATE_ENTRY(EnumerateInteractionRenderModelIdsEXT),
    PALPATE_ENTRY(CreateRenderModelEXT),
    PALPATE_ENTRY(DestroyRenderModelEXT),
    PALPATE_ENTRY(GetRenderModelPropertiesEXT),
    PALPATE_ENTRY(CreateRenderModelSpaceEXT),
    PALPATE_ENTRY(GetRenderModelStateEXT),
    PALPATE_ENTRY(CreateRenderModelAssetEXT),
    PALPATE_ENTRY(DestroyRenderModelAssetEXT),
    PALPATE_ENTRY(GetRenderModelAssetDataEXT),
    PALPATE_ENTRY(GetRenderModelAssetPropertiesEXT),
    PALPATE_ENTRY(EnumerateDisplayRefreshRatesFB),
    PALPATE_ENTRY(GetDisplayRefreshRateFB),
    PALPATE_ENTRY(RequestDisplayRefreshRateFB),
};
#undef PALPATE_ENTRY

}  // namespace

PFN_xrVoidFunction function_named(const std::string& name) {
  static const std::unordered_map<std::string, PFN_xrVoidFunction> all = [] {
    std::unordered_map<std::string, PFN_xrVoidFunction> made;
    for (const Entry& entry : kEntries) made[entry.name] = entry.function;
    return made;
  }();
  const auto at = all.find(name);
  return at == all.end() ? nullptr : at->second;
}

XrResult xr_GetInstanceProcAddr(XrInstance instance, const char* name,
                                PFN_xrVoidFunction* function) {
  const Call call("xrGetInstanceProcAddr");
  if (call.answered()) return call.answer();
  *function = function_named(name);
  if (!*function) return XR_ERROR_FUNCTION_UNSUPPORTED;
  const std::string text = name;
  const bool without = text == "xrEnumerateInstanceExtensionProperties" ||
                       text == "xrCreateInstance" || text == "xrGetInstanceProcAddr";
  return instance || without ? XR_SUCCESS : XR_ERROR_HANDLE_INVALID;
}

}  // namespace palpate::test::fake

XrResult xrNegotiateLoaderRuntimeInterface(const LoaderInfo* loader, RuntimeRequest* request) {
  if (loader->struct_type != 1 || request->struct_type != 3) return XR_ERROR_INITIALIZATION_FAILED;
  if (loader->min_interface_version > 1 || loader->max_interface_version < 1)
    return XR_ERROR_INITIALIZATION_FAILED;
  request->runtime_interface_version = 1;
  request->runtime_api_version = XR_CURRENT_API_VERSION;
  request->get_instance_proc_addr = &palpate::test::fake::xr_GetInstanceProcAddr;
  return XR_SUCCESS;
}
