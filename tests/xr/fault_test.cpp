// Every OpenXR call of the module x every error that the specification allows for it x the first,
// second and fifth time. One error occurs: afterwards the session must be up and focused again,
// then end normally, with every handle destroyed and no call out of order.

#include <openxr/openxr.h>

#include <map>
#include <set>

#include "tests/xr/xr_fixture.h"

namespace palpate::test {
namespace {

using xr::HeadsetState;
using xr::Trouble;
using Errors = std::vector<XrResult>;

/// Errors of all calls with an instance.
const Errors kOfInstance{XR_ERROR_VALIDATION_FAILURE, XR_ERROR_RUNTIME_FAILURE,
                         XR_ERROR_HANDLE_INVALID, XR_ERROR_INSTANCE_LOST};
const Errors kOfSession{XR_ERROR_VALIDATION_FAILURE, XR_ERROR_RUNTIME_FAILURE,
                        XR_ERROR_HANDLE_INVALID, XR_ERROR_INSTANCE_LOST, XR_ERROR_SESSION_LOST};
const Errors kMaking{XR_ERROR_OUT_OF_MEMORY, XR_ERROR_LIMIT_REACHED};

Errors operator+(Errors a, const Errors& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

struct Row {
  const char* function;
  Errors errors;
};

/// The errors are those of the specification's "Return Codes" of each function.
std::vector<Row> table() {
  const Errors system{XR_ERROR_SYSTEM_INVALID};
  const Errors small{XR_ERROR_SIZE_INSUFFICIENT};
  const Errors graphics = kOfInstance + kMaking + system + Errors{XR_ERROR_FUNCTION_UNSUPPORTED};
  const Errors model{XR_ERROR_FUNCTION_UNSUPPORTED, XR_ERROR_OUT_OF_MEMORY};
  // Of XR_EXT_render_model, which Debian 12's headers lack.
  constexpr auto kModelIdInvalid = XrResult(-1000300000), kAssetUnavailable = XrResult(-1000300001),
                 kGltfExtensionRequired = XrResult(-1000300002);
  const Errors action{XR_ERROR_PATH_UNSUPPORTED, XR_ERROR_PATH_INVALID,
                      XR_ERROR_ACTION_TYPE_MISMATCH, XR_ERROR_ACTIONSET_NOT_ATTACHED};
  return {
      {"xrEnumerateInstanceExtensionProperties",
       {XR_ERROR_VALIDATION_FAILURE, XR_ERROR_RUNTIME_FAILURE, XR_ERROR_OUT_OF_MEMORY,
        XR_ERROR_SIZE_INSUFFICIENT, XR_ERROR_RUNTIME_UNAVAILABLE, XR_ERROR_API_LAYER_NOT_PRESENT}},
      {"xrCreateInstance",
       {XR_ERROR_VALIDATION_FAILURE, XR_ERROR_RUNTIME_FAILURE, XR_ERROR_OUT_OF_MEMORY,
        XR_ERROR_LIMIT_REACHED, XR_ERROR_RUNTIME_UNAVAILABLE, XR_ERROR_NAME_INVALID,
        XR_ERROR_INITIALIZATION_FAILED, XR_ERROR_EXTENSION_NOT_PRESENT,
        XR_ERROR_API_VERSION_UNSUPPORTED, XR_ERROR_API_LAYER_NOT_PRESENT}},
      {"xrGetInstanceProperties", kOfInstance},
      {"xrPollEvent", kOfInstance},
      {"xrStringToPath",
       kOfInstance + Errors{XR_ERROR_PATH_FORMAT_INVALID, XR_ERROR_PATH_COUNT_EXCEEDED}},
      {"xrPathToString", kOfInstance + small + Errors{XR_ERROR_PATH_INVALID}},
      {"xrGetSystem",
       kOfInstance + Errors{XR_ERROR_FORM_FACTOR_UNAVAILABLE, XR_ERROR_FORM_FACTOR_UNSUPPORTED}},
      {"xrGetSystemProperties", kOfInstance + system + Errors{XR_ERROR_OUT_OF_MEMORY}},
      {"xrEnumerateViewConfigurations", kOfInstance + system + small},
      {"xrEnumerateViewConfigurationViews",
       kOfInstance + system + small + Errors{XR_ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED}},
      {"xrEnumerateEnvironmentBlendModes",
       kOfInstance + system + small + Errors{XR_ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED}},
      {"xrGetVulkanGraphicsRequirements2KHR", graphics},
      {"xrCreateVulkanInstanceKHR", graphics},
      {"xrGetVulkanGraphicsDevice2KHR", graphics},
      {"xrCreateVulkanDeviceKHR", graphics},
      {"xrConvertTimeToTimespecTimeKHR",
       kOfInstance + Errors{XR_ERROR_TIME_INVALID, XR_ERROR_FUNCTION_UNSUPPORTED}},
      {"xrCreateSession",
       kOfInstance + kMaking + system +
           Errors{XR_ERROR_INITIALIZATION_FAILED, XR_ERROR_GRAPHICS_DEVICE_INVALID,
                  XR_ERROR_GRAPHICS_REQUIREMENTS_CALL_MISSING}},
      {"xrEnumerateReferenceSpaces", kOfSession + small},
      {"xrCreateReferenceSpace",
       kOfSession + kMaking + Errors{XR_ERROR_POSE_INVALID, XR_ERROR_REFERENCE_SPACE_UNSUPPORTED}},
      {"xrCreateActionSpace", kOfSession + kMaking + action + Errors{XR_ERROR_POSE_INVALID}},
      {"xrLocateSpace", kOfSession + Errors{XR_ERROR_TIME_INVALID}},
      {"xrCreateActionSet",
       kOfInstance + kMaking +
           Errors{XR_ERROR_PATH_FORMAT_INVALID, XR_ERROR_NAME_INVALID, XR_ERROR_NAME_DUPLICATED,
                  XR_ERROR_LOCALIZED_NAME_INVALID, XR_ERROR_LOCALIZED_NAME_DUPLICATED}},
      {"xrCreateAction",
       kOfInstance + kMaking +
           Errors{XR_ERROR_PATH_UNSUPPORTED, XR_ERROR_NAME_DUPLICATED,
                  XR_ERROR_LOCALIZED_NAME_DUPLICATED, XR_ERROR_ACTIONSETS_ALREADY_ATTACHED}},
      {"xrSuggestInteractionProfileBindings",
       kOfInstance + Errors{XR_ERROR_PATH_UNSUPPORTED, XR_ERROR_PATH_INVALID,
                            XR_ERROR_ACTIONSETS_ALREADY_ATTACHED}},
      {"xrAttachSessionActionSets", kOfSession + Errors{XR_ERROR_ACTIONSETS_ALREADY_ATTACHED}},
      {"xrGetCurrentInteractionProfile", kOfSession + action},
      {"xrBeginSession", kOfSession + Errors{XR_ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED,
                                             XR_ERROR_SESSION_RUNNING, XR_ERROR_SESSION_NOT_READY}},
      {"xrWaitFrame", kOfSession + Errors{XR_ERROR_SESSION_NOT_RUNNING}},
      {"xrBeginFrame",
       kOfSession + Errors{XR_ERROR_SESSION_NOT_RUNNING, XR_ERROR_CALL_ORDER_INVALID}},
      {"xrLocateViews",
       kOfSession + small +
           Errors{XR_ERROR_TIME_INVALID, XR_ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED}},
      {"xrGetVisibilityMaskKHR",
       kOfSession + small +
           Errors{XR_ERROR_FUNCTION_UNSUPPORTED, XR_ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED}},
      {"xrEnumerateSwapchainFormats", kOfSession + small},
      {"xrCreateSwapchain",
       kOfSession + kMaking +
           Errors{XR_ERROR_SWAPCHAIN_FORMAT_UNSUPPORTED, XR_ERROR_FEATURE_UNSUPPORTED}},
      {"xrEnumerateSwapchainImages", kOfSession + small},
      {"xrAcquireSwapchainImage", kOfSession + Errors{XR_ERROR_CALL_ORDER_INVALID}},
      {"xrWaitSwapchainImage", kOfSession + Errors{XR_ERROR_CALL_ORDER_INVALID}},
      {"xrReleaseSwapchainImage", kOfSession + Errors{XR_ERROR_CALL_ORDER_INVALID}},
      {"xrSyncActions",
       kOfSession + Errors{XR_ERROR_PATH_UNSUPPORTED, XR_ERROR_ACTIONSET_NOT_ATTACHED}},
      {"xrGetActionStateBoolean", kOfSession + action},
      {"xrGetActionStateFloat", kOfSession + action},
      {"xrGetActionStatePose", kOfSession + action},
      {"xrApplyHapticFeedback", kOfSession + action},
      {"xrStopHapticFeedback", kOfSession + action},
      {"xrCreateHandTrackerEXT",
       kOfSession + kMaking + Errors{XR_ERROR_FUNCTION_UNSUPPORTED, XR_ERROR_FEATURE_UNSUPPORTED}},
      {"xrLocateHandJointsEXT",
       kOfSession + Errors{XR_ERROR_TIME_INVALID, XR_ERROR_FUNCTION_UNSUPPORTED}},
      {"xrDestroyHandTrackerEXT",
       {XR_ERROR_HANDLE_INVALID, XR_ERROR_INSTANCE_LOST, XR_ERROR_SESSION_LOST,
        XR_ERROR_FUNCTION_UNSUPPORTED}},
      {"xrEnumerateDisplayRefreshRatesFB",
       kOfSession + small + Errors{XR_ERROR_FUNCTION_UNSUPPORTED}},
      {"xrGetDisplayRefreshRateFB", kOfSession + Errors{XR_ERROR_FUNCTION_UNSUPPORTED}},
      {"xrRequestDisplayRefreshRateFB",
       kOfSession + Errors{XR_ERROR_FUNCTION_UNSUPPORTED, XR_ERROR_FEATURE_UNSUPPORTED,
                           XR_ERROR_DISPLAY_REFRESH_RATE_UNSUPPORTED_FB}},
      {"xrEnumerateInteractionRenderModelIdsEXT",
       kOfSession + small + Errors{XR_ERROR_FUNCTION_UNSUPPORTED, XR_ERROR_OUT_OF_MEMORY}},
      {"xrCreateRenderModelEXT",
       kOfSession + kMaking +
           Errors{XR_ERROR_FUNCTION_UNSUPPORTED, kModelIdInvalid, kGltfExtensionRequired}},
      {"xrDestroyRenderModelEXT", {XR_ERROR_HANDLE_INVALID, XR_ERROR_FUNCTION_UNSUPPORTED}},
      {"xrGetRenderModelPropertiesEXT", kOfSession + model},
      {"xrCreateRenderModelSpaceEXT", kOfSession + kMaking + model},
      {"xrGetRenderModelStateEXT", kOfSession + model + Errors{XR_ERROR_TIME_INVALID}},
      {"xrCreateRenderModelAssetEXT", kOfSession + kMaking + model + Errors{kAssetUnavailable}},
      {"xrDestroyRenderModelAssetEXT", {XR_ERROR_HANDLE_INVALID, XR_ERROR_FUNCTION_UNSUPPORTED}},
      {"xrGetRenderModelAssetDataEXT", kOfSession + small + model},
      {"xrGetRenderModelAssetPropertiesEXT", kOfSession + model},
      {"xrEndFrame", kOfSession + Errors{XR_ERROR_CALL_ORDER_INVALID, XR_ERROR_LAYER_INVALID,
                                         XR_ERROR_POSE_INVALID, XR_ERROR_LAYER_LIMIT_EXCEEDED,
                                         XR_ERROR_SWAPCHAIN_RECT_INVALID,
                                         XR_ERROR_ENVIRONMENT_BLEND_MODE_UNSUPPORTED,
                                         XR_ERROR_SESSION_NOT_RUNNING, XR_ERROR_TIME_INVALID}},
      {"xrRequestExitSession", kOfSession + Errors{XR_ERROR_SESSION_NOT_RUNNING}},
      {"xrEndSession",
       kOfSession + Errors{XR_ERROR_SESSION_NOT_STOPPING, XR_ERROR_SESSION_NOT_RUNNING}},
      {"xrDestroySpace", kOfSession},
      {"xrDestroySwapchain", kOfSession},
      {"xrDestroyActionSet", kOfInstance},
      {"xrDestroySession", kOfSession},
      {"xrDestroyInstance", kOfInstance},
  };
}

class XrFault : public XrTest {
 protected:
  /// A complete run: up to focus, ten frames with all calls of a frame, and the end.
  void live(const std::string& what) {
    GradientSource own;
    own.needed_s = 0.01;
    xr::Headset headset({}, own);
    live(headset, what);
  }
  void live(xr::Headset& headset, const std::string& what) {
    headset.look_again();
    const auto step = [&] {
      now_ns_ += 11'111'111;
      const xr::Report& report = headset.step(now_ns_);
      EXPECT_STRNE(xr::name(report.state), "") << what;
      if (report.state == HeadsetState::kNoRuntime) headset.look_again();
      if (report.state == HeadsetState::kWaiting) {
        EXPECT_FALSE(report.problem.message.empty()) << what;
        now_ns_ += 1'000'000'000;
      }
      return report.state;
    };
    int focused = 0;
    for (int i = 0; i < 200 && focused < 10; ++i) {
      if (step() != HeadsetState::kFocused) continue;
      ++focused;
      headset.vibrate(0, 0.5 * (focused % 2));
      headset.vibrate(1, 0.5 * (focused % 2));
    }
    EXPECT_EQ(focused, 10) << "not up again: " << what << ", " << headset.report().problem.message;
    headset.end(now_ns_);
    for (int i = 0; i < 300 && headset.report().state != HeadsetState::kEnded; ++i) step();
    EXPECT_EQ(headset.report().state, HeadsetState::kEnded) << what;
  }
};

/// Calls that are made only while there is no runtime or no device yet.
bool is_early(const std::string& function) {
  return function == "xrEnumerateInstanceExtensionProperties" || function == "xrCreateInstance" ||
         function.find("Vulkan") != std::string::npos;
}

TEST_F(XrFault, EveryCallTimesEveryErrorTimesFirstAndLaterTime) {
  live("a life without errors");
  const std::map<std::string, int> usual = runtime().all_calls();
  int cases = 0;
  // One headset goes through all cases on one device; each early call needs a new headset.
  source.needed_s = 0.01;
  xr::Headset lasting({}, source);
  live(lasting, "the first of many");
  for (const Row& row : table()) {
    ASSERT_TRUE(usual.count(row.function)) << "never called: " << row.function;
    for (const XrResult error : row.errors) {
      for (const int nth : {1, 2, 5}) {
        if (nth > usual.at(row.function)) continue;
        const std::string what = std::string(row.function) + " returned " +
                                 std::to_string(int(error)) + " the time " + std::to_string(nth);
        runtime().reset();
        runtime().inject(row.function, nth, error);
        if (is_early(row.function))
          live(what);
        else
          live(lasting, what);
        ++cases;
        EXPECT_TRUE(runtime().injected_all()) << "the error was not injected: " << what;
        EXPECT_EQ(runtime().alive(), "") << what;
        EXPECT_THAT(runtime().violations(), ::testing::IsEmpty()) << what;
        if (HasFailure()) return;
      }
    }
  }
  EXPECT_GT(cases, 600);
  RecordProperty("cases", cases);
}

TEST_F(XrFault, TableHasEveryCallThatTheModuleMakes) {
  live("a life without errors");
  std::set<std::string> known;
  for (const Row& row : table()) known.insert(row.function);
  // The OpenXR loader itself calls it many times: the next test is about this function.
  for (const auto& [function, count] : runtime().all_calls()) {
    if (function == "xrGetInstanceProcAddr") continue;
    EXPECT_TRUE(known.count(function)) << function;
  }
}

TEST_F(XrFault, ComesBackAfterAnExtensionsFunctionWasNotThere) {
  live("a life without errors");
  const int all = runtime().calls("xrGetInstanceProcAddr");
  // The last call is the loader's, for xrDestroyInstance; the twelve before it are the module's:
  // four for Vulkan, one each for the clock and the mask, three for hands, three for the rate.
  for (int nth = all - 12; nth < all; ++nth) {
    runtime().reset();
    runtime().inject("xrGetInstanceProcAddr", nth, XR_ERROR_FUNCTION_UNSUPPORTED);
    live("address " + std::to_string(nth));
    EXPECT_TRUE(runtime().injected_all());
    EXPECT_GE(runtime().calls("xrCreateInstance"), 2) << "the first instance can not be used";
  }
}

}  // namespace
}  // namespace palpate::test
