#pragma once

#include "module/xr/instance.h"

namespace palpate::xr {

inline constexpr int64_t kSecond_ns = 1'000'000'000;

/// A time of the monotonic clock.
struct TimeStamp {
  int64_t ns = 0;
  bool exact = true;  ///< false: guessed
};

/// The system's time in ns of its monotonic clock.
int64_t ns_of(SystemTime time);

/// XrTime as a time of the monotonic clock. Without kTimeExtension their offset is unknown: then
/// display times are assumed to be one period after now_ns, when xrWaitFrame returned.
Outcome<TimeStamp> time_stamp_of(const Instance& instance, XrTime time, XrDuration period,
                                 int64_t now_ns);

/// The monotonic clock now: CLOCK_MONOTONIC, or Windows' performance counter.
int64_t monotonic_ns();

}  // namespace palpate::xr
