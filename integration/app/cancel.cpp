#include "integration/app/cancel.h"

#include <pthread.h>
#include <unistd.h>

#include <cstdlib>
#include <ctime>
#include <string_view>

#include "integration/app/exit_code.h"

namespace palpate::app {

CancelOnSignal::CancelOnSignal() {
  sigemptyset(&signals_);
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) {
    struct sigaction action {};
    sigaction(number, nullptr, &action);
    if (action.sa_handler != SIG_IGN) sigaddset(&signals_, number);
  }
  pthread_sigmask(SIG_BLOCK, &signals_, &before_);
  watcher_ = std::jthread([this](std::stop_token ended) { watch(std::move(ended)); });
}

CancelOnSignal::~CancelOnSignal() {
  watcher_.request_stop();
  watcher_.join();
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

void CancelOnSignal::watch(std::stop_token ended) {
  // A waiting signal wakes at once; the time limit is only how long the end of the work may wait.
  const timespec tick{0, 50'000'000};
  while (!ended.stop_requested()) {
    if (sigtimedwait(&signals_, nullptr, &tick) <= 0) continue;
    if (at_once_) {
      constexpr std::string_view kSentence = "palpate: Stopped as asked, before anything began.\n";
      [[maybe_unused]] const ssize_t said =
          ::write(STDERR_FILENO, kSentence.data(), kSentence.size());
      std::_Exit(kExitInternal);
    }
    // Asked again: at_quick_exit() of emergency waits for the ramp.
    if (source_.stop_requested()) std::quick_exit(kExitInternal);
    source_.request_stop();
  }
}

}  // namespace palpate::app
