#pragma once

#include <cstdint>
#include <ctime>

namespace palpate::devices {

/// CLOCK_MONOTONIC, the clock that readings are stamped with, ns. Any thread; real-time safe.
inline int64_t now_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return int64_t(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

}  // namespace palpate::devices
