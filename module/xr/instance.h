#pragma once

#include <vulkan/vulkan.h>
// Vulkan comes first: openxr_platform.h speaks of its types.
#define XR_USE_GRAPHICS_API_VULKAN
#define XR_USE_TIMESPEC
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>

#include <ctime>
#include <string>
#include <type_traits>

#include "module/xr/call.h"
#include "module/xr/newer_openxr.h"

namespace palpate::xr {

#ifdef _WIN32
inline constexpr bool kOnWindows = true;
#else
inline constexpr bool kOnWindows = false;
#endif
/// The system's time, as runtimes give it instead of XrTime: of CLOCK_MONOTONIC, or on Windows of
/// the performance counter (a LARGE_INTEGER without its header).
using SystemTime = std::conditional_t<kOnWindows, int64_t, timespec>;
inline constexpr const char* kTimeExtension = kOnWindows
                                                  ? "XR_KHR_win32_convert_performance_counter_time"
                                                  : XR_KHR_CONVERT_TIMESPEC_TIME_EXTENSION_NAME;
inline constexpr const char* kTimeCall =
    kOnWindows ? "xrConvertTimeToWin32PerformanceCounterKHR" : "xrConvertTimeToTimespecTimeKHR";
using ConvertTime = XrResult(XRAPI_PTR*)(XrInstance, XrTime, SystemTime*);

/// First in the life cycle: the connection to a runtime, with the extensions that palpate uses.
/// Move-only.
class Instance {
 public:
  /// Connects to the runtime that the loader finds; overlay: for sessions above another program's.
  /// kNoRuntime, kRuntimeDown, kUnsupported.
  static Outcome<Instance> make(bool overlay = false);

  XrInstance handle() const { return handle_.get(); }
  /// Name and version, for people.
  const std::string& runtime() const { return runtime_; }

  bool has_depth_layer() const { return depth_layer_; }
  bool has_visibility_mask() const { return get_visibility_mask != nullptr; }
  bool has_hand_tracking() const { return create_hand_tracker != nullptr; }
  bool has_hand_interaction() const { return hand_interaction_; }
  /// Whether there may be views of a second, narrower pair: System says so.
  bool has_quad_views() const { return quad_views_; }
  /// The same where that pair follows the gaze.
  bool has_foveation() const { return foveation_; }
  bool has_clock() const { return convert_time != nullptr; }

  /// True with the next event in `event`, or false. The caller reuses one buffer, since it has 4
  /// kB.
  Outcome<bool> next_event(XrEventDataBuffer& event) const;

  Outcome<XrPath> path(const char* text) const;

  // XR_KHR_vulkan_enable2, never null.
  PFN_xrGetVulkanGraphicsRequirements2KHR get_vulkan_requirements = nullptr;
  PFN_xrCreateVulkanInstanceKHR create_vulkan_instance = nullptr;
  PFN_xrGetVulkanGraphicsDevice2KHR get_vulkan_device = nullptr;
  PFN_xrCreateVulkanDeviceKHR create_vulkan_device = nullptr;
  // Null where the runtime lacks the extension.
  ConvertTime convert_time = nullptr;
  PFN_xrGetVisibilityMaskKHR get_visibility_mask = nullptr;
  PFN_xrCreateHandTrackerEXT create_hand_tracker = nullptr;  ///< all three, or none
  PFN_xrDestroyHandTrackerEXT destroy_hand_tracker = nullptr;
  PFN_xrLocateHandJointsEXT locate_hand_joints = nullptr;
  PFN_xrEnumerateDisplayRefreshRatesFB enumerate_refresh_rates = nullptr;  ///< the same
  PFN_xrGetDisplayRefreshRateFB get_refresh_rate = nullptr;
  PFN_xrRequestDisplayRefreshRateFB request_refresh_rate = nullptr;
  ModelFunctions models;

 private:
  Done load_functions(bool clock, bool mask, bool hands, bool rates);
  Done load_models();

  XrHandle<XrInstance, xrDestroyInstance> handle_;
  std::string runtime_;
  bool depth_layer_ = false, hand_interaction_ = false;
  bool quad_views_ = false, foveation_ = false;
};

}  // namespace palpate::xr
