#pragma once

#include <csignal>
#include <stop_token>
#include <thread>

namespace palpate::app {

/// Turns Ctrl-C (SIGINT) and SIGTERM into a stop request while it lives, so that nothing half
/// written stays behind; a second one ends the program at once. Make it before any other thread
/// starts: threads inherit the blocked signals. One at a time.
class CancelOnSignal {
 public:
  CancelOnSignal();
  ~CancelOnSignal();
  CancelOnSignal(const CancelOnSignal&) = delete;
  CancelOnSignal& operator=(const CancelOnSignal&) = delete;

  std::stop_token token() const { return source_.get_token(); }

 private:
  void watch(std::stop_token ended);

  sigset_t signals_{};
  sigset_t before_{};
  std::stop_source source_;
  std::jthread watcher_;
};

}  // namespace palpate::app
