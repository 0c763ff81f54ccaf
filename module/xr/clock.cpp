#include "module/xr/clock.h"

#include <ctime>

namespace palpate::xr {

Outcome<TimeStamp> time_stamp_of(const Instance& instance, XrTime time, XrDuration period,
                                 int64_t now_ns) {
  if (!instance.convert_time_to_timespec) return TimeStamp{now_ns + period, false};
  timespec at{};
  const XrResult result = instance.convert_time_to_timespec(instance.handle(), time, &at);
  if (XR_FAILED(result)) return problem_of("xrConvertTimeToTimespecTimeKHR", result);
  return TimeStamp{int64_t(at.tv_sec) * kSecond_ns + int64_t(at.tv_nsec), true};
}

int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return int64_t(now.tv_sec) * kSecond_ns + int64_t(now.tv_nsec);
}

}  // namespace palpate::xr
