#pragma once

#include <cstdint>

namespace palpate {
class ServoLoop;
}

/// Zero force on every exit of the process. install() puts handlers in place; from then on SIGINT,
/// SIGTERM, SIGHUP and SIGQUIT, a crash (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT), an exception
/// that nobody catches, and exit() from any thread ask all servo loops for their ramp. The loops go
/// on running, since they share no lock with any other thread. The crashing thread waits in the
/// handler until all are at rest, at most kMostWait_ms. Then the process ends as it would without
/// these handlers (same signal, same exit code; earlier handlers are called).
///
/// A crash of the servo thread itself: its handler ramps the last force down, unless the crash was
/// in the device's own code: that code can not be called again.
///
/// What can not be caught: kill -9, _exit(), an overflow of the stack in a thread without
/// sigaltstack (install() gives one to its caller, the servo thread has one), a halt of the whole
/// process (kill -STOP, a debugger) and a power cut. For kill -9 only another process can act, and
/// only on the device's side. The system closes the device when the process dies, so a second
/// process that waits for that (a pipe whose writing end the first one holds) may open it and send
/// zero. A device with a watchdog of its own, as most have, drops the force first.
namespace palpate::emergency {

inline constexpr int kMostWait_ms = 800;

/// Once per process, from the main thread, before other threads are started; further calls do
/// nothing. Not real-time safe.
void install();

/// True once anything of the above has asked for a stop. Stays true. Any thread, real-time safe.
bool is_asked() noexcept;

/// Ends the process after the ramp of all servo loops, without destructors: for a program in which
/// something hangs. Any thread.
[[noreturn]] void end_process(int exit_code) noexcept;

/// Called by a servo thread: that it begins (false: there are 8 loops already), whether it is at
/// rest, and that it ends. rest() is real-time safe.
bool join(ServoLoop* loop);
void rest(bool at_rest) noexcept;
void leave() noexcept;

}  // namespace palpate::emergency
