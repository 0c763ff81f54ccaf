#include <windows.h>
// After windows.h, which it needs.
#include <avrt.h>

#include "module/haptics/servo/real_time.h"

namespace palpate {
namespace {

constexpr size_t kStackBytes = 256 * 1024;

/// Not inlined: its frame is the stack that is touched.
[[gnu::noinline]] void touch_stack() {
  volatile char frame[kStackBytes] = {};
  frame[0] = frame[kStackBytes - 1];
}

/// The priority of the multimedia scheduler; where that service does not run, the highest priority
/// for which a program needs no special right.
void set_priority(ServoReport& report) {
  const char* what = "real-time priority";
  DWORD task = 0;
  if (const HANDLE registered = AvSetMmThreadCharacteristicsW(L"Pro Audio", &task)) {
    AvSetMmThreadPriority(registered, AVRT_PRIORITY_CRITICAL);
    report.has_priority = true;
    report.items.push_back(
        {what, true, "That of the task \"Pro Audio\" of the multimedia scheduler."});
  } else if (SetThreadPriority(GetCurrentThread(), THREAD_PRIORITY_TIME_CRITICAL)) {
    report.items.push_back({what, false,
                            "The thread has the highest priority of ordinary programs: for more, "
                            "start the service \"Multimedia Class Scheduler\"."});
  } else {
    report.items.push_back({what, false, "Other programs can delay the loop."});
  }
}

}  // namespace

ProcessPreparation::ProcessPreparation(const RealTimeOptions& options, ServoReport& report) {
  report.kernel = "Windows";
  if (options.lock_memory)
    report.items.push_back({"locked memory", false,
                            "Memory is not locked: Windows locks single pages only, so one may be "
                            "missing when the loop needs it."});
}

ProcessPreparation::~ProcessPreparation() = default;

void prepare_thread(const RealTimeOptions& options, ServoReport& report) {
  touch_stack();
  if (options.core >= 0) {
    const std::string name = "core " + std::to_string(options.core);
    const bool done = options.core < int(8 * sizeof(DWORD_PTR)) &&
                      SetThreadAffinityMask(GetCurrentThread(), DWORD_PTR(1) << options.core) != 0;
    report.items.push_back({"pinned to a core", done,
                            done ? "Runs on " + name + "."
                                 : "There is no " + name + " for this program: choose another."});
  }
  if (options.priority > 0) set_priority(report);
}

std::vector<int> usable_cores() {
  DWORD_PTR own = 0, all = 0;
  GetProcessAffinityMask(GetCurrentProcess(), &own, &all);
  std::vector<int> usable;
  for (int core = 0; core < int(8 * sizeof own); ++core)
    if (own >> core & 1) usable.push_back(core);
  return usable;
}

void give_way(BackgroundWork work) noexcept {
  SetThreadPriority(GetCurrentThread(), work == BackgroundWork::kEstimation
                                            ? THREAD_PRIORITY_LOWEST
                                            : THREAD_PRIORITY_BELOW_NORMAL);
}

}  // namespace palpate
