#pragma once

#include "module/xr/instance.h"

namespace palpate::xr {

/// A moment of the monotonic clock.
struct Moment {
  int64_t ns = 0;
  bool exact = true;  ///< false: guessed
};

/// XrTime as a moment of CLOCK_MONOTONIC. Without XR_KHR_convert_timespec_time nothing ties the two
/// together: then display times are taken to be one period ahead of now_ns, which is when
/// xrWaitFrame returns.
Outcome<Moment> moment_of(const Instance& instance, XrTime time, XrDuration period, int64_t now_ns);

/// CLOCK_MONOTONIC now.
int64_t monotonic_ns();

}  // namespace palpate::xr
