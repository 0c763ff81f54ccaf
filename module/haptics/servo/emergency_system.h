#pragma once

/// What of emergency.h differs from system to system: emergency_linux.cpp, emergency_windows.cpp.
namespace palpate::emergency {

/// Asks all loops for their ramp and waits until they are at rest, at most kMostWait_ms. In
/// handlers: no lock, no memory.
void ask_and_wait() noexcept;
/// Asks for the end of the program in its own way. False: it was asked before.
bool ask_once() noexcept;

/// Puts handlers for crashes and requests to end in place; they call the two above.
void catch_crashes_and_requests();
/// For each thread in which a handler may run: its own stack for it.
void prepare_thread_for_handlers();
/// In handlers, too.
void sleep_a_millisecond() noexcept;

/// While it lives, threads that are started get no signals of the process: those are for other
/// threads.
class SignalsElsewhere {
 public:
  SignalsElsewhere();
  ~SignalsElsewhere();
  SignalsElsewhere(const SignalsElsewhere&) = delete;
  SignalsElsewhere& operator=(const SignalsElsewhere&) = delete;

 private:
  struct Before;
  Before* before_ = nullptr;
};

}  // namespace palpate::emergency
