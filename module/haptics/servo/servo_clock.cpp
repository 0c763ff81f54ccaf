#include "module/haptics/servo/servo_clock.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <thread>

#include "module/haptics/servo/monotonic.h"

namespace palpate {

int64_t MonotonicClock::now_ns() noexcept {
  return monotonic_ns();
}

ComputedClock::ComputedClock() : now_ns_(monotonic_ns()), limit_ns_(now_ns_) {}

void ComputedClock::sleep_until(int64_t time_ns) noexcept {
  std::unique_lock lock(mutex_);
  while (limit_ns_ < time_ns) {
    now_ns_ = std::max(now_ns_.load(), limit_ns_);
    passes_.wait(lock);
  }
  now_ns_ = std::max(now_ns_.load(), time_ns);
}

void ComputedClock::let_pass(int64_t duration_ns) {
  const int64_t longest_ns = monotonic_ns() + duration_ns;
  int64_t until_ns = 0;
  {
    const std::lock_guard lock(mutex_);
    until_ns = limit_ns_ = limit_ns_ + duration_ns;
  }
  passes_.notify_all();
  while (now_ns_ < until_ns && monotonic_ns() < longest_ns)
    std::this_thread::sleep_for(std::chrono::microseconds(200));
}

void ComputedClock::let_go() {
  {
    const std::lock_guard lock(mutex_);
    limit_ns_ = std::numeric_limits<int64_t>::max();
  }
  passes_.notify_all();
}

}  // namespace palpate
