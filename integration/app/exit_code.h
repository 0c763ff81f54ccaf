#pragma once

#include "compute/motion/verdict.h"
#include "compute/volume/result.h"

namespace palpate::app {

/// The exit codes, for scripts. Documented in README and in --help: never renumber.
enum ExitCode : int {
  kExitOk = 0,
  kExitInternal = 1,  ///< the device or the program failed, or the user stopped it
  kExitBad = 2,       ///< an input or output can not be used, or no device can do the work
  kExitSuspect = 3,   ///< done, but a person should check the fields before using them
  kExitFailed = 4,    ///< done, but the fields must not be used
};

struct ExitMeaning {
  ExitCode code;
  const char* meaning;
};
/// What --help and the manual say of each.
inline constexpr ExitMeaning kExitMeanings[] = {
    {kExitOk, "ok"},
    {kExitInternal, "device or program failed or was stopped"},
    {kExitBad, "input or output can not be used"},
    {kExitSuspect, "the result is suspect"},
    {kExitFailed, "the result failed"}};

inline int exit_code(const Error& error) {
  switch (error.kind) {
    case ErrorKind::kBadInput:
    case ErrorKind::kNotFinite:
    case ErrorKind::kBadOutput:
    case ErrorKind::kNoDevice:
    case ErrorKind::kOutOfMemory:
      return kExitBad;
    case ErrorKind::kDeviceFailed:
    case ErrorKind::kCancelled:
      return kExitInternal;
  }
  return kExitInternal;
}

inline int exit_code(Trust trust) {
  switch (trust) {
    case Trust::kOk:
      return kExitOk;
    case Trust::kSuspect:
      return kExitSuspect;
    case Trust::kFailed:
      return kExitFailed;
  }
  return kExitInternal;
}

}  // namespace palpate::app
