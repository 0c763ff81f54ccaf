#pragma once

#include <chrono>
#include <cstdint>

namespace palpate {

/// CLOCK_MONOTONIC in ns (on Windows the performance counter): the time of ticks, poses and
/// devices. Any thread, real-time safe.
inline int64_t monotonic_ns() noexcept {
  return std::chrono::steady_clock::now().time_since_epoch().count();
}

}  // namespace palpate
