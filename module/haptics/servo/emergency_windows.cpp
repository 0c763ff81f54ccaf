#include <windows.h>

#include <csignal>
#include <utility>

#include "module/haptics/servo/emergency_system.h"

namespace palpate::emergency {
namespace {

LPTOP_LEVEL_EXCEPTION_FILTER filter_before = nullptr;

LONG WINAPI on_crash(EXCEPTION_POINTERS* exception) {
  ask_and_wait();
  return filter_before ? filter_before(exception) : EXCEPTION_CONTINUE_SEARCH;
}

/// abort() ends the process after it.
void on_abort(int) {
  ask_and_wait();
}

/// Called in a thread of its own. Where a console was closed, Windows ends the process on return.
BOOL WINAPI on_request(DWORD kind) {
  const bool first = ask_once();
  if (first && (kind == CTRL_C_EVENT || kind == CTRL_BREAK_EVENT)) return TRUE;
  ask_and_wait();
  return FALSE;  // and the next handler ends the process
}

}  // namespace

void catch_crashes_and_requests() {
  filter_before = SetUnhandledExceptionFilter(on_crash);
  std::signal(SIGABRT, on_abort);
  SetConsoleCtrlHandler(on_request, TRUE);
}

/// So that an overflow of the stack leaves room for the handler.
void prepare_thread_for_handlers() {
  ULONG bytes = 64 * 1024;
  SetThreadStackGuarantee(&bytes);
}

void sleep_a_millisecond() noexcept {
  Sleep(1);
}

// Windows has no signals.
std::thread thread_without_signals(std::function<void()> work) {
  return std::thread(std::move(work));
}

}  // namespace palpate::emergency
