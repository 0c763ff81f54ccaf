#include "integration/app/cancel.h"

#include <pthread.h>
#include <unistd.h>

#include <cstdlib>
#include <ctime>
#include <string_view>

#include "integration/app/exit_code.h"

namespace palpate::app {
namespace {

/// Signals delivered to a thread that does not block them.
std::atomic<int> taken_by_handler{0};
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler may touch nothing else");

void count_signal(int) {
  ++taken_by_handler;
}

/// Called on a thread that shares no lock with threads that may hang. The emergency handler waits
/// for the end of the force's ramp.
[[noreturn]] void end_now(std::string_view sentence) {
  [[maybe_unused]] const ssize_t said = ::write(STDERR_FILENO, sentence.data(), sentence.size());
  std::quick_exit(kExitInternal);
}

}  // namespace

CancelOnSignal::CancelOnSignal() {
  sigemptyset(&signals_);
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) {
    struct sigaction action {};
    sigaction(number, nullptr, &action);
    if (action.sa_handler != SIG_IGN) sigaddset(&signals_, number);
  }
  pthread_sigmask(SIG_BLOCK, &signals_, &before_);
  struct sigaction counting {};
  counting.sa_handler = count_signal;
  counting.sa_flags = SA_RESTART;
  taken_by_handler = 0;
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) {
    if (sigismember(&signals_, number) != 1) continue;
    sigaction(number, &counting, &actions_before_.emplace_back(number, counting).second);
  }
  watcher_ = std::jthread([this](std::stop_token ended) { watch(std::move(ended)); });
}

CancelOnSignal::~CancelOnSignal() {
  watcher_.request_stop();
  watcher_.join();
  struct sigaction ignoring {};
  ignoring.sa_handler = SIG_IGN;
  for (const auto& [number, action] : actions_before_)
    sigaction(number, source_.stop_requested() ? &ignoring : &action, nullptr);
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

void CancelOnSignal::watch(std::stop_token ended) {
  using Clock = std::chrono::steady_clock;
  Clock::time_point asked;
  // A waiting signal wakes this thread at once. The time limit bounds the delay after the end of
  // the work, and after a signal that the handler took.
  const timespec tick{0, 50'000'000};
  while (!ended.stop_requested()) {
    const bool is_new =
        sigtimedwait(&signals_, nullptr, &tick) > 0 || taken_by_handler.exchange(0) > 0;
    if (is_new && at_once_) end_now("palpate: Stopped as asked, before anything began.\n");
    if (is_new && source_.stop_requested() && Clock::now() - asked > kSameRequest)
      end_now("palpate: Ended at once, after a second signal.\n");
    if (is_new && !source_.stop_requested()) {
      asked = Clock::now();
      source_.request_stop();
    }
    const auto patience = patience_.load();
    if (source_.stop_requested() && patience != std::chrono::seconds::max() &&
        Clock::now() - asked > patience)
      end_now("palpate: Something did not stop when it was asked to, so the program was ended.\n");
  }
}

}  // namespace palpate::app
