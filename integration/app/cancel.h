#pragma once

#include <atomic>
#include <chrono>
#include <csignal>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

namespace palpate::app {

/// While it lives, turns Ctrl-C (SIGINT), SIGTERM, SIGHUP (the terminal was closed) and SIGQUIT
/// into a stop request, so that no half-written file stays behind. What follows within kSameRequest
/// is the same request: timeout, Slurm and systemd send a signal to the program and to its group,
/// and Ctrl-C reaches both through a program that passes it on. A later signal ends the program at
/// once (after the servo thread's ramp). After a request, signals are ignored when this has ended,
/// since the program is about to end. A signal that was ignored when the program was started
/// (nohup) stays ignored. Threads that start later inherit the blocked signals; older ones (a
/// library may start threads when it is loaded, before main()) get a handler that only counts. One
/// object at a time.
class CancelOnSignal {
 public:
  static constexpr std::chrono::seconds kSameRequest{2};

  CancelOnSignal();
  ~CancelOnSignal();
  CancelOnSignal(const CancelOnSignal&) = delete;
  CancelOnSignal& operator=(const CancelOnSignal&) = delete;

  std::stop_token token() const { return source_.get_token(); }

  /// While true, a signal ends the program at once, with one sentence and exit code 1: for work
  /// that has not written anything and can not be stopped, such as reading files. Any thread.
  void end_at_once(bool yes) { at_once_ = yes; }

  /// If the program still runs this long after a signal, it is ended with one sentence: a driver or
  /// a headset's runtime may wait for ever for something that no longer runs. Any thread.
  void give_up_after(std::chrono::seconds patience) { patience_ = patience; }

 private:
  void watch(std::stop_token ended);

  sigset_t signals_{};
  sigset_t before_{};
  std::vector<std::pair<int, struct sigaction>> actions_before_;  ///< of the signals
  std::stop_source source_;
  std::atomic<bool> at_once_{false};
  std::atomic<std::chrono::seconds> patience_{std::chrono::seconds::max()};
  std::jthread watcher_;
};

}  // namespace palpate::app
