#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>

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

/// monotonic_ns(), and sleeping on it: on Linux until an absolute time, on Windows by a timer with
/// a high resolution.
class MonotonicClock : public ServoClock {
 public:
  int64_t now_ns() noexcept override;
  void sleep_until(int64_t time_ns) noexcept override;
};

/// A clock that another thread lets go on: a loop that sleeps on it runs as fast as it computes.
/// For programs under test whose device is simulated. It starts at the monotonic clock's time.
class ComputedClock : public ServoClock {
 public:
  ComputedClock();
  int64_t now_ns() noexcept override { return now_ns_.load(); }
  /// Waits until let_pass() has let the time come.
  void sleep_until(int64_t time_ns) noexcept override;

  /// Lets so much time pass, and waits until the loop has slept through it; at most as long as it
  /// takes on a real clock, so that a slow loop does not hold the caller up. One thread.
  void let_pass(int64_t duration_ns);
  /// Lets all time pass: a loop that is to end needs some.
  void let_go();

 private:
  std::atomic<int64_t> now_ns_;
  // Not std::atomic::wait(): on Windows, GCC 12's can miss the notification.
  std::mutex mutex_;
  std::condition_variable passes_;
  int64_t limit_ns_;
};

}  // namespace palpate
