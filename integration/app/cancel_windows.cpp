#include <windows.h>

#include <atomic>

#include "integration/app/cancel.h"

namespace palpate::app {
namespace {

std::atomic<int> asked{0};
std::atomic<bool> ignores{false};
HANDLE came = nullptr;  ///< an event, made once and kept: a handler may run at any time

/// Called in a thread of its own. Ctrl-C leaves the program to end itself; where the console, the
/// user's session or the system ends, Windows ends the process when this returns.
BOOL WINAPI on_request(DWORD kind) {
  if (!ignores) {
    ++asked;
    SetEvent(came);
  }
  if (kind != CTRL_C_EVENT && kind != CTRL_BREAK_EVENT) Sleep(INFINITE);
  return TRUE;
}

}  // namespace

struct EndRequests::System {};

EndRequests::EndRequests() {
  if (!came) came = CreateEventW(nullptr, FALSE, FALSE, nullptr);
  asked = 0;
  ignores = false;
  SetConsoleCtrlHandler(on_request, TRUE);
}

EndRequests::~EndRequests() = default;

void EndRequests::give_back(bool ignored) {
  ignores = ignored;
  if (!ignored) SetConsoleCtrlHandler(on_request, FALSE);
}

bool EndRequests::wait() {
  WaitForSingleObject(came, 50);
  return asked.exchange(0) > 0;
}

}  // namespace palpate::app
