#pragma once

#include <string>

#include "compute/volume/result.h"

namespace palpate::xr {

/// Why there is no picture in the headset; this also determines what is tried next. Every OpenXR
/// call of this folder that fails is one of these; none ends the program.
enum class Trouble {
  kNoRuntime,  ///< No OpenXR runtime is installed or chosen. Not asked again by itself.
  /// A runtime is installed but does not answer: its service does not run. Asked again.
  kRuntimeDown,
  /// The runtime lacks something that palpate needs; the message says what. Asked again.
  kUnsupported,
  kNoHeadset,     ///< The runtime runs, the headset is off or unplugged. Asked again.
  kNoGraphics,    ///< No Vulkan device could be made for the headset, or it was lost. Asked again.
  kInstanceLost,  ///< The runtime went away (crashed, restarted, updated). All is made anew.
  kSessionLost,  ///< The runtime took the session away (headset unplugged). A new one is asked for.
  /// The runtime refused a call for any other reason. Everything is made anew, with growing pauses.
  kRefused,
};

/// One failed call.
struct Problem {
  Trouble trouble = Trouble::kRefused;
  std::string message;    ///< one sentence for a person: what is wrong and what to do
  const char* call = "";  ///< the OpenXR (or Vulkan) call that failed
  int result = 0;         ///< its XrResult
};

/// What an error of the Vulkan device is for the headset: kNoGraphics.
Problem of_device(const Error& error);

/// "xrCreateInstance returned -51", for those who look for the cause; empty if no call failed.
std::string call_text(const Problem& problem);
/// The sentence of a problem; with_call: also the call that failed, where one did.
std::string problem_text(const Problem& problem, bool with_call);

template <class T>
using Outcome = Result<T, Problem>;
using Done = Outcome<Nothing>;

}  // namespace palpate::xr
