#include "module/haptics/servo/servo_clock.h"

#include <cerrno>
#include <ctime>

namespace palpate {

int64_t MonotonicClock::now_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return int64_t(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

void MonotonicClock::sleep_until(int64_t time_ns) noexcept {
  const timespec until{.tv_sec = time_t(time_ns / 1'000'000'000),
                       .tv_nsec = long(time_ns % 1'000'000'000)};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

}  // namespace palpate
