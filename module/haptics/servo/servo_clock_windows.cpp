#include <windows.h>

#include "module/haptics/servo/servo_clock.h"

namespace palpate {
namespace {

// CREATE_WAITABLE_TIMER_HIGH_RESOLUTION, which MinGW's headers lack; Windows has it since version
// 1803.
constexpr DWORD kHighResolution = 0x2;

/// A timer of the calling thread. The resolution of ordinary ones is that of the system's tick, up
/// to 16 ms.
class Timer {
 public:
  Timer() : timer_(CreateWaitableTimerExW(nullptr, nullptr, kHighResolution, TIMER_ALL_ACCESS)) {
    if (!timer_) timer_ = CreateWaitableTimerExW(nullptr, nullptr, 0, TIMER_ALL_ACCESS);
  }
  ~Timer() {
    if (timer_) CloseHandle(timer_);
  }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

  void sleep_ns(int64_t duration_ns) noexcept {
    LARGE_INTEGER due;
    due.QuadPart = -((duration_ns + 99) / 100);  // negative: from now on, in units of 100 ns
    if (timer_ && SetWaitableTimer(timer_, &due, 0, nullptr, nullptr, FALSE))
      WaitForSingleObject(timer_, INFINITE);
    else
      Sleep(1);
  }

 private:
  HANDLE timer_;
};

}  // namespace

void MonotonicClock::sleep_until(int64_t time_ns) noexcept {
  thread_local Timer timer;
  for (int64_t now = now_ns(); now < time_ns; now = now_ns()) timer.sleep_ns(time_ns - now);
}

}  // namespace palpate
