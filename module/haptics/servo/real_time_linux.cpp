#include "module/haptics/servo/real_time.h"

#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>

namespace palpate {
namespace {

constexpr size_t kStackBytes = 256 * 1024;

/// With a limit on locked memory later allocations of the whole program would fail, so memory is
/// locked only where there is no limit.
bool may_lock_all() {
  rlimit limit{};
  if (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY) return true;
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    constexpr int kIpcLock = 14;  // CAP_IPC_LOCK: the limit does not count
    if (line.rfind("CapEff:", 0) == 0)
      return (std::strtoull(line.c_str() + 7, nullptr, 16) >> kIpcLock & 1) != 0;
  }
  return false;
}

std::string kernel_line() {
  utsname name{};
  if (uname(&name) != 0) return "unknown";
  std::string realtime;
  std::ifstream("/sys/kernel/realtime") >> realtime;
  return preemption(name.version, realtime) + ", Linux " + name.release;
}

void lock_memory(ServoReport& report) {
  const char* what = "locked memory";
  if (!may_lock_all()) {
    report.items.push_back(
        {what, false,
         "Memory is not locked, so a page may be missing when the loop needs it: "
         "allow it with \"memlock unlimited\" in /etc/security/limits.d."});
    return;
  }
  // MCL_ONFAULT: what is never touched, such as most of a driver's reserve, is not brought in.
  if (mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0) {
    report.items.push_back({what, true, "No page that was touched is taken away."});
  } else {
    report.items.push_back(
        {what, false, std::string("Memory could not be locked: ") + std::strerror(errno) + "."});
  }
}

void set_priority(int wanted, ServoReport& report) {
  const char* what = "real-time priority";
  const int highest = sched_get_priority_max(SCHED_FIFO);
  sched_param parameter{};
  parameter.sched_priority = std::clamp(wanted, 1, highest);
  int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter);
  rlimit limit{};
  if (error == EPERM && getrlimit(RLIMIT_RTPRIO, &limit) == 0 && limit.rlim_cur > 0 &&
      limit.rlim_cur < rlim_t(parameter.sched_priority)) {
    parameter.sched_priority = int(limit.rlim_cur);
    error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter);
  }
  if (error == 0) {
    report.has_priority = true;
    report.items.push_back(
        {what, true, "SCHED_FIFO at " + std::to_string(parameter.sched_priority) + "."});
  } else {
    report.items.push_back({what, false,
                            "Other programs can delay the loop: allow real-time priority with "
                            "\"rtprio 95\" in /etc/security/limits.d and log in again."});
  }
}

void pin(int core, ServoReport& report) {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  if (core < CPU_SETSIZE) CPU_SET(size_t(core), &cores);
  const bool done = pthread_setaffinity_np(pthread_self(), sizeof cores, &cores) == 0;
  const std::string name = "core " + std::to_string(core);
  report.items.push_back({"pinned to a core", done,
                          done ? "Runs on " + name + "."
                               : "There is no " + name + " for this program: choose another."});
}

/// Not inlined: its frame is the stack that is touched.
[[gnu::noinline]] void touch_stack() {
  volatile char frame[kStackBytes] = {};
  frame[0] = frame[kStackBytes - 1];
}

}  // namespace

std::string preemption(const std::string& uname_version, const std::string& realtime_file) {
  const auto has = [&](const char* word) { return uname_version.find(word) != std::string::npos; };
  if (realtime_file == "1" || has("PREEMPT_RT")) return "PREEMPT_RT";
  if (has("PREEMPT_DYNAMIC")) return "PREEMPT_DYNAMIC";
  if (has("PREEMPT")) return "PREEMPT";
  return "voluntary";
}

ProcessPreparation::ProcessPreparation(const RealTimeOptions& options, ServoReport& report) {
  report.kernel = kernel_line();
  if (options.lock_memory) lock_memory(report);
  if (!options.cores_awake) return;
  latency_file_ = open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
  const int32_t none_us = 0;
  const bool done =
      latency_file_ >= 0 && write(latency_file_, &none_us, sizeof none_us) == sizeof none_us;
  report.items.push_back({"cores kept awake", done,
                          done ? "No core sleeps deeply while the loop runs."
                               : "Waking up may take some 100 us longer: let this user write to "
                                 "/dev/cpu_dma_latency, or boot with processor.max_cstate=1."});
}

ProcessPreparation::~ProcessPreparation() {
  if (latency_file_ >= 0) close(latency_file_);
}

void prepare_thread(const RealTimeOptions& options, ServoReport& report) {
  pthread_setname_np(pthread_self(), "palpate-servo");
  touch_stack();
  if (options.core >= 0) pin(options.core, report);
  const bool exact = prctl(PR_SET_TIMERSLACK, 1ul, 0ul, 0ul, 0ul) == 0;
  report.items.push_back(
      {"timer slack", exact,
       exact ? "Timers may be 1 ns late by choice." : "The system lets timers be 50 us late."});
  if (options.priority > 0) set_priority(options.priority, report);
}

std::vector<int> usable_cores() {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  sched_getaffinity(0, sizeof cores, &cores);
  std::vector<int> usable;
  for (int core = 0; core < CPU_SETSIZE; ++core)
    if (CPU_ISSET(core, &cores)) usable.push_back(core);
  return usable;
}

void give_way(BackgroundWork work) noexcept {
  setpriority(PRIO_PROCESS, id_t(gettid()), int(work));
}

}  // namespace palpate
