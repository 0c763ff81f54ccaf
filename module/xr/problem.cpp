#include "module/xr/problem.h"

#include <string_view>

#include "module/xr/call.h"

namespace palpate::xr {
namespace {

Trouble trouble_of(std::string_view call, XrResult result) {
  switch (result) {
    case XR_ERROR_RUNTIME_UNAVAILABLE:
    case XR_ERROR_FILE_ACCESS_ERROR:
    case XR_ERROR_FILE_CONTENTS_INVALID:
      return Trouble::kNoRuntime;
    case XR_ERROR_INSTANCE_LOST:
      return Trouble::kInstanceLost;
    case XR_ERROR_SESSION_LOST:
      return Trouble::kSessionLost;
    case XR_ERROR_FORM_FACTOR_UNAVAILABLE:
      return Trouble::kNoHeadset;
    case XR_ERROR_API_VERSION_UNSUPPORTED:
    case XR_ERROR_EXTENSION_NOT_PRESENT:
    case XR_ERROR_FORM_FACTOR_UNSUPPORTED:
    case XR_ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED:
    case XR_ERROR_REFERENCE_SPACE_UNSUPPORTED:
    case XR_ERROR_SWAPCHAIN_FORMAT_UNSUPPORTED:
      return Trouble::kUnsupported;
    case XR_ERROR_GRAPHICS_DEVICE_INVALID:
      return Trouble::kNoGraphics;
    default:
      break;
  }
  // This is how a runtime reports that its service does not run.
  const bool first_calls =
      call == "xrCreateInstance" || call == "xrEnumerateInstanceExtensionProperties";
  return first_calls ? Trouble::kRuntimeDown : Trouble::kRefused;
}

const char* sentence(Trouble trouble) {
  switch (trouble) {
    case Trouble::kNoRuntime:
      return "There is no OpenXR runtime: start one (Monado, SteamVR) or let XR_RUNTIME_JSON name "
             "its manifest.";
    case Trouble::kRuntimeDown:
      return "The OpenXR runtime does not answer: start its service, it is asked again.";
    case Trouble::kUnsupported:
      return "The OpenXR runtime can not do what palpate needs.";
    case Trouble::kNoHeadset:
      return "The headset is off or unplugged: switch it on, it is waited for.";
    case Trouble::kNoGraphics:
      return "The headset can not be driven by this Vulkan device.";
    case Trouble::kInstanceLost:
      return "The OpenXR runtime went away: it is waited for.";
    case Trouble::kSessionLost:
      return "The headset was taken away: it is waited for.";
    case Trouble::kRefused:
      return "The OpenXR runtime refused a call: it is tried again.";
  }
  return "";
}

}  // namespace

Problem problem_of(const char* call, XrResult result) {
  const Trouble trouble = trouble_of(call, result);
  return {trouble, sentence(trouble), call, int(result)};
}

Problem of_device(const Error& error) {
  return {Trouble::kNoGraphics, error.message, "the Vulkan device", 0};
}

std::string call_text(const Problem& problem) {
  return *problem.call ? std::string(problem.call) + " returned " + std::to_string(problem.result)
                       : std::string();
}

std::string problem_text(const Problem& problem, bool with_call) {
  const std::string call = call_text(problem);
  return problem.message + (with_call && !call.empty() ? " (" + call + ".)" : "");
}

}  // namespace palpate::xr
