#include "module/haptics/servo/emergency.h"

#include <signal.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <mutex>

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

constexpr std::array<int, 5> kCrashes = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
constexpr std::array<int, 4> kRequests = {SIGINT, SIGTERM, SIGHUP, SIGQUIT};
std::array<struct sigaction, 64> actions_before;

// All of this is called from signal handlers: atomics and nanosleep only.

bool all_at_rest() noexcept {
  for (const Seat& seat : seats)
    if (seat.taken.load() && !seat.at_rest.load()) return false;
  return true;
}

void ask_and_wait() noexcept {
  asked.store(true);
  if (my_loop) {
    my_loop->ramp_down_now();
    my_seat->at_rest.store(true);
  }
  for (int ms = 0; ms < kMostWait_ms && !all_at_rest(); ++ms) {
    const timespec one_ms{.tv_sec = 0, .tv_nsec = 1'000'000};
    nanosleep(&one_ms, nullptr);
  }
}

void on_crash(int number, siginfo_t* info, void*) {
  ask_and_wait();
  sigaction(number, &actions_before[size_t(number)], nullptr);
  // A fault of the processor happens again on return, now with the earlier action and with the
  // registers that a core dump needs. A signal that was sent has to be sent again.
  if (info->si_code <= 0) raise(number);
}

void on_request(int number, siginfo_t*, void*) {
  if (!asked.exchange(true)) return;  // the program ends in its own way
  // Asked a second time: it did not.
  ask_and_wait();
  sigaction(number, &actions_before[size_t(number)], nullptr);
  raise(number);
}

[[noreturn]] void on_terminate() {
  ask_and_wait();
  if (terminate_before) terminate_before();
  std::abort();
}

void give_signal_stack() {
  // A stack that is there already (of a sanitizer or a host) stays: its owner removes it.
  stack_t before{};
  if (sigaltstack(nullptr, &before) == 0 && !(before.ss_flags & SS_DISABLE)) return;
  // Kept for the life of the thread: a handler may need it until the very end.
  thread_local std::array<char, 64 * 1024> memory;
  stack_t stack{};
  stack.ss_sp = memory.data();
  stack.ss_size = memory.size();
  sigaltstack(&stack, nullptr);
}

void catch_signal(int number, void (*handler)(int, siginfo_t*, void*), int flags) {
  struct sigaction action {};
  action.sa_sigaction = handler;
  action.sa_flags = SA_SIGINFO | SA_ONSTACK | flags;
  sigemptyset(&action.sa_mask);
  sigaction(number, &action, &actions_before[size_t(number)]);
}

}  // namespace

void install() {
  static std::once_flag once;
  std::call_once(once, [] {
    give_signal_stack();
    for (int number : kCrashes) catch_signal(number, on_crash, 0);
    for (int number : kRequests) {
      catch_signal(number, on_request, SA_RESTART);
      // Ignored before (as under nohup): stays ignored.
      if (actions_before[size_t(number)].sa_handler == SIG_IGN)
        sigaction(number, &actions_before[size_t(number)], nullptr);
    }
    terminate_before = std::set_terminate(on_terminate);
    std::atexit([] { ask_and_wait(); });
    std::at_quick_exit([] { ask_and_wait(); });
  });
}

bool is_asked() noexcept {
  return asked.load(std::memory_order_relaxed);
}

bool join(ServoLoop* loop) {
  for (Seat& seat : seats) {
    if (seat.taken.exchange(true)) continue;
    seat.at_rest.store(false);
    my_seat = &seat;
    my_loop = loop;
    give_signal_stack();
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
