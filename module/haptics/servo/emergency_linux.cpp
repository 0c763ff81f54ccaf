#include <pthread.h>
#include <signal.h>

#include <array>
#include <cstdlib>
#include <ctime>
#include <utility>

#include "module/haptics/servo/emergency_system.h"

namespace palpate::emergency {
namespace {

constexpr std::array<int, 5> kCrashes = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
constexpr std::array<int, 4> kRequests = {SIGINT, SIGTERM, SIGHUP, SIGQUIT};
std::array<struct sigaction, 64> actions_before;

void on_crash(int number, siginfo_t* info, void*) {
  ask_and_wait();
  sigaction(number, &actions_before[size_t(number)], nullptr);
  // A fault of the processor happens again on return, now with the earlier action and with the
  // registers that a core dump needs. A signal that was sent has to be sent again.
  if (info->si_code <= 0) raise(number);
}

void on_request(int number, siginfo_t*, void*) {
  if (ask_once()) return;  // the program ends in its own way
  // Asked a second time: it did not.
  ask_and_wait();
  sigaction(number, &actions_before[size_t(number)], nullptr);
  raise(number);
}

void catch_signal(int number, void (*handler)(int, siginfo_t*, void*), int flags) {
  struct sigaction action {};
  action.sa_sigaction = handler;
  action.sa_flags = SA_SIGINFO | SA_ONSTACK | flags;
  sigemptyset(&action.sa_mask);
  sigaction(number, &action, &actions_before[size_t(number)]);
}

}  // namespace

void catch_crashes_and_requests() {
  for (int number : kCrashes) catch_signal(number, on_crash, 0);
  for (int number : kRequests) {
    catch_signal(number, on_request, SA_RESTART);
    // Ignored before (as under nohup): stays ignored.
    if (actions_before[size_t(number)].sa_handler == SIG_IGN)
      sigaction(number, &actions_before[size_t(number)], nullptr);
  }
  std::at_quick_exit([] { ask_and_wait(); });
}

void prepare_thread_for_handlers() {
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

void sleep_a_millisecond() noexcept {
  const timespec one_ms{.tv_sec = 0, .tv_nsec = 1'000'000};
  nanosleep(&one_ms, nullptr);
}

/// Not blocked: crashes, and the signals by which a runtime with garbage collection (Mono, Unity)
/// stops each of its threads. A host's function that the servo calls makes it such a thread, and a
/// collection would wait for it for ever.
std::thread thread_without_signals(std::function<void()> work) {
  sigset_t all, before;
  sigfillset(&all);
  for (int crash : kCrashes) sigdelset(&all, crash);
  for (int collection : {SIGPWR, SIGXCPU}) sigdelset(&all, collection);
  for (int real_time = SIGRTMIN; real_time <= SIGRTMAX; ++real_time) sigdelset(&all, real_time);
  // A new thread has the mask of the one that starts it.
  pthread_sigmask(SIG_SETMASK, &all, &before);
  std::thread thread(std::move(work));
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return thread;
}

}  // namespace palpate::emergency
