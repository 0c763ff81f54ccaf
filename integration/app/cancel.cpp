#include "integration/app/cancel.h"

#include <pthread.h>

#include <cstdlib>
#include <ctime>

#include "integration/app/exit_code.h"

namespace palpate::app {

CancelOnSignal::CancelOnSignal() {
  sigemptyset(&signals_);
  sigaddset(&signals_, SIGINT);
  sigaddset(&signals_, SIGTERM);
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
    if (source_.stop_requested()) std::_Exit(kExitInternal);
    source_.request_stop();
  }
}

}  // namespace palpate::app
