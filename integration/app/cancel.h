#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <stop_token>
#include <thread>

namespace palpate::app {

/// What asks this program to end: on Linux Ctrl-C (SIGINT), SIGTERM, SIGHUP (the terminal was
/// closed) and SIGQUIT, on Windows Ctrl-C, Ctrl-Break and the end of the console, of the user's
/// session or of the system. While it lives they are taken here. A signal that was ignored when
/// the program was started (nohup) stays ignored. Threads that start later inherit the blocked
/// signals; older ones (a library may start threads when it is loaded, before main()) get a handler
/// that only counts. One object at a time.
class EndRequests {
 public:
  EndRequests();
  /// Gives them back to who had them; `ignored`: nobody gets them any more.
  void give_back(bool ignored);
  ~EndRequests();

  /// Waits until one comes, at most 50 ms.
  bool wait();

 private:
  struct System;
  std::unique_ptr<System> system_;
};

/// While it lives, turns requests to end the program into a stop request, so that no half-written
/// file stays behind. What follows within kSameRequest is the same request: timeout, Slurm and
/// systemd send a signal to the program and to its group, and Ctrl-C reaches both through a program
/// that passes it on. A later one ends the program at once (after the servo thread's ramp). After a
/// request they are ignored when this has ended, since the program is about to end. One object at a
/// time.
class CancelOnSignal {
 public:
  static constexpr std::chrono::seconds kSameRequest{2};

  CancelOnSignal();
  ~CancelOnSignal();
  CancelOnSignal(const CancelOnSignal&) = delete;
  CancelOnSignal& operator=(const CancelOnSignal&) = delete;

  std::stop_token token() const { return source_.get_token(); }

  /// While true, a request ends the program at once, with one sentence and exit code 1: for work
  /// that has not written anything and can not be stopped, such as reading files. Any thread.
  void end_at_once(bool yes) { at_once_ = yes; }

  /// If the program still runs this long after a request, it is ended with one sentence: a driver
  /// or a headset's runtime may wait for ever for something that no longer runs. Any thread.
  void give_up_after(std::chrono::seconds patience) { patience_ = patience; }

 private:
  void watch(std::stop_token ended);

  EndRequests requests_;
  std::stop_source source_;
  std::atomic<bool> at_once_{false};
  std::atomic<std::chrono::seconds> patience_{std::chrono::seconds::max()};
  std::jthread watcher_;
};

}  // namespace palpate::app
