#include "module/haptics/servo/emergency.h"

#include <array>
#include <atomic>
#include <cstdlib>
#include <exception>
#include <mutex>

#include "module/haptics/servo/emergency_system.h"
#include "module/haptics/servo/servo_loop.h"

namespace palpate::emergency {
namespace {

/// A servo loop as the handlers see it. Static, so that a handler never reads memory that was
/// freed.
struct Seat {
  std::atomic<bool> taken{false}, at_rest{false};
};
std::array<Seat, 8> seats;
thread_local Seat* my_seat = nullptr;
thread_local ServoLoop* my_loop = nullptr;

std::atomic<bool> asked{false};
std::terminate_handler terminate_before = nullptr;

// All of this is called from signal handlers: atomics and sleeping only.

bool all_at_rest() noexcept {
  for (const Seat& seat : seats)
    if (seat.taken.load() && !seat.at_rest.load()) return false;
  return true;
}

[[noreturn]] void on_terminate() {
  ask_and_wait();
  if (terminate_before) terminate_before();
  std::abort();
}

}  // namespace

void ask_and_wait() noexcept {
  asked.store(true);
  if (my_loop) {
    my_loop->ramp_down_now();
    my_seat->at_rest.store(true);
  }
  for (int ms = 0; ms < kMostWait_ms && !all_at_rest(); ++ms) sleep_a_millisecond();
}

bool ask_once() noexcept {
  return !asked.exchange(true);
}

void install() {
  static std::once_flag once;
  std::call_once(once, [] {
    prepare_thread_for_handlers();
    catch_crashes_and_requests();
    terminate_before = std::set_terminate(on_terminate);
    std::atexit([] { ask_and_wait(); });
  });
}

bool is_asked() noexcept {
  return asked.load(std::memory_order_relaxed);
}

void end_process(int exit_code) noexcept {
  ask_and_wait();
  std::_Exit(exit_code);
}

bool join(ServoLoop* loop) {
  for (Seat& seat : seats) {
    if (seat.taken.exchange(true)) continue;
    seat.at_rest.store(false);
    my_seat = &seat;
    my_loop = loop;
    prepare_thread_for_handlers();
    return true;
  }
  return false;
}

void rest(bool at_rest) noexcept {
  if (my_seat) my_seat->at_rest.store(at_rest, std::memory_order_release);
}

void leave() noexcept {
  my_loop = nullptr;
  if (!my_seat) return;
  my_seat->taken.store(false);
  my_seat = nullptr;
}

}  // namespace palpate::emergency
