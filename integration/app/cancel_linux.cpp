#include <pthread.h>

#include <atomic>
#include <csignal>
#include <ctime>
#include <utility>
#include <vector>

#include "integration/app/cancel.h"

namespace palpate::app {
namespace {

/// Signals delivered to a thread that does not block them.
std::atomic<int> taken_by_handler{0};
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler may touch nothing else");

void count_signal(int) {
  ++taken_by_handler;
}

}  // namespace

struct EndRequests::System {
  sigset_t signals{};
  sigset_t before{};
  std::vector<std::pair<int, struct sigaction>> actions_before;  ///< of the signals
};

EndRequests::EndRequests() : system_(std::make_unique<System>()) {
  sigemptyset(&system_->signals);
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) {
    struct sigaction action {};
    sigaction(number, nullptr, &action);
    if (action.sa_handler != SIG_IGN) sigaddset(&system_->signals, number);
  }
  pthread_sigmask(SIG_BLOCK, &system_->signals, &system_->before);
  struct sigaction counting {};
  counting.sa_handler = count_signal;
  counting.sa_flags = SA_RESTART;
  taken_by_handler = 0;
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) {
    if (sigismember(&system_->signals, number) != 1) continue;
    sigaction(number, &counting, &system_->actions_before.emplace_back(number, counting).second);
  }
}

EndRequests::~EndRequests() = default;

void EndRequests::give_back(bool ignored) {
  struct sigaction ignoring {};
  ignoring.sa_handler = SIG_IGN;
  for (const auto& [number, action] : system_->actions_before)
    sigaction(number, ignored ? &ignoring : &action, nullptr);
  pthread_sigmask(SIG_SETMASK, &system_->before, nullptr);
}

bool EndRequests::wait() {
  const timespec most{0, 50'000'000};
  return sigtimedwait(&system_->signals, nullptr, &most) > 0 || taken_by_handler.exchange(0) > 0;
}

}  // namespace palpate::app
