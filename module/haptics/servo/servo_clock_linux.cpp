#include <cerrno>
#include <ctime>

#include "module/haptics/servo/servo_clock.h"

namespace palpate {

void MonotonicClock::sleep_until(int64_t time_ns) noexcept {
  const timespec until{.tv_sec = time_t(time_ns / 1'000'000'000),
                       .tv_nsec = long(time_ns % 1'000'000'000)};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

}  // namespace palpate
