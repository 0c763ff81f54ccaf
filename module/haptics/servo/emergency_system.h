#pragma once

#include <functional>
#include <thread>

/// Between emergency.cpp and what differs from system to system: emergency_linux.cpp,
/// emergency_windows.cpp.
namespace palpate::emergency {

/// Asks all loops for their ramp and waits until they are at rest, at most kMostWait_ms. In
/// handlers: no lock, no memory.
void ask_and_wait() noexcept;
/// Asks for the end of the program in its own way. False: it was asked before.
bool ask_once() noexcept;

/// Installs handlers for crashes and for requests to end the program; they call the two above.
void catch_crashes_and_requests();
/// Gives the calling thread room on a stack for a handler that runs in it.
void prepare_thread_for_handlers();
/// May be called in handlers.
void sleep_a_millisecond() noexcept;

/// Starts a thread that gets no signals of the process: those are for other threads.
std::thread thread_without_signals(std::function<void()> work);

}  // namespace palpate::emergency
