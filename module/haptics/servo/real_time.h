#pragma once

#include <string>
#include <vector>

namespace palpate {

/// What the servo thread asks the system for. All are tried; the loop runs without them too.
struct RealTimeOptions {
  int priority = 80;        ///< of SCHED_FIFO, 1 to 99; 0: not asked for
  int core = -1;            ///< the thread is pinned to this one; -1: to none
  bool lock_memory = true;  ///< no page of the process may be taken away again
  bool cores_awake = true;  ///< no deep sleep of the cores while the loop runs
};

/// What was granted, for people: a sentence each that says what it means or what to do.
struct ServoReport {
  struct Item {
    std::string what;  ///< "real-time priority"
    bool obtained = false;
    std::string sentence;
  };
  /// "PREEMPT_RT", "PREEMPT_DYNAMIC", "PREEMPT" or "voluntary", and its release
  std::string kernel;
  std::vector<Item> items;
  bool has_priority = false;  ///< real-time priority was obtained
};

/// Linux alone: what kind of preemption a kernel has, from the version line that uname gives and
/// what /sys/kernel/realtime says ("1", or empty where it is not there).
std::string preemption(const std::string& uname_version, const std::string& realtime_file);

/// Locks the process's memory as it is touched from now on (it stays locked: that is the process's,
/// not the thread's) and keeps the cores awake until it is destroyed. Not real-time safe.
class ProcessPreparation {
 public:
  ProcessPreparation(const RealTimeOptions& options, ServoReport& report);
  ~ProcessPreparation();
  ProcessPreparation(const ProcessPreparation&) = delete;
  ProcessPreparation& operator=(const ProcessPreparation&) = delete;

 private:
  int latency_file_ = -1;
};

/// For the calling thread: priority, core and 256 KiB of stack touched; on Linux also a name and a
/// timer slack of 1 ns. Not real-time safe itself.
void prepare_thread(const RealTimeOptions& options, ServoReport& report);

/// The processor cores that this process may use, in ascending order. Any thread.
std::vector<int> usable_cores();

/// Work that gives way to the servo loop, with its niceness. kEstimation beside a loop without
/// real-time priority: pictures come before it. kFirstMotion: what moves the data at all, and all
/// estimation beside a loop that has real-time priority; with ten other busy processes on two cores
/// it still gets more than a quarter of a core.
enum class BackgroundWork { kFirstMotion = 1, kPictures = 5, kEstimation = 10 };

/// Lowers the priority of the calling thread and, by inheritance, of all that it starts, such as
/// those of a Vulkan driver (on Windows nothing is inherited).
void give_way(BackgroundWork work) noexcept;

}  // namespace palpate
