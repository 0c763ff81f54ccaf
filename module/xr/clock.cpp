#include "module/xr/clock.h"

#include <chrono>

namespace palpate::xr {

Outcome<TimeStamp> time_stamp_of(const Instance& instance, XrTime time, XrDuration period,
                                 int64_t now_ns) {
  if (!instance.convert_time) return TimeStamp{now_ns + period, false};
  SystemTime at{};
  const XrResult result = instance.convert_time(instance.handle(), time, &at);
  if (XR_FAILED(result)) return problem_of(kTimeCall, result);
  return TimeStamp{ns_of(at), true};
}

int64_t monotonic_ns() {
  return std::chrono::steady_clock::now().time_since_epoch().count();
}

}  // namespace palpate::xr
