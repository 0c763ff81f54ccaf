#include <windows.h>

#include "module/xr/clock.h"

namespace palpate::xr {

int64_t ns_of(SystemTime time) {
  static const int64_t counts_per_s = [] {
    LARGE_INTEGER frequency;
    QueryPerformanceFrequency(&frequency);  // never fails
    return int64_t(frequency.QuadPart);
  }();
  return time / counts_per_s * kSecond_ns + time % counts_per_s * kSecond_ns / counts_per_s;
}

}  // namespace palpate::xr
