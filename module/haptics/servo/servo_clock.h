#pragma once

#include <cstdint>

namespace palpate {

/// Where the servo loop takes its time from, so that tests need no real time. One thread, real-time
/// safe.
class ServoClock {
 public:
  virtual ~ServoClock() = default;
  virtual int64_t now_ns() noexcept = 0;
  /// Returns when now_ns() has reached the time, at once if it has already.
  virtual void sleep_until(int64_t time_ns) noexcept = 0;
};

/// CLOCK_MONOTONIC, and absolute sleeping on it.
class MonotonicClock : public ServoClock {
 public:
  int64_t now_ns() noexcept override;
  void sleep_until(int64_t time_ns) noexcept override;
};

}  // namespace palpate
