#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "module/haptics/cause.h"
#include "module/haptics/device.h"
#include "module/haptics/servo/statistics.h"

namespace palpate::vulkan {
class Context;
}

/// The main task for a given time, with all kinds of faults. It has the real servo thread and
/// clock, the haptic step with all its guards, a simulated hand on a beating heart, scenes and
/// fields exchanged while it runs, and a device that fails at random.
namespace palpate::soak {

struct Options {
  double seconds = 20.0;
  uint32_t seed = 1;
  /// The device on which the exchanged fields are estimated from noisy frames; null: the true
  /// fields.
  std::shared_ptr<vulkan::Context> context;
  /// Called now and then with the seconds since the start.
  std::function<void(double seconds)> progress;
};

/// How often each fault of the device was injected.
struct Injected {
  uint64_t unplugged = 0, timeouts = 0, garbage = 0, jumps = 0, not_numbers = 0, stale = 0,
           stalls = 0, clock_back = 0;
  uint64_t all() const {
    return unplugged + timeouts + garbage + jumps + not_numbers + stale + stalls + clock_back;
  }
};

/// Processor time of repeated work in one thread.
struct OwnTime {
  /// How often it took more than a period.
  uint64_t count = 0;
  int64_t longest_ns = 0, all_ns = 0;
};

/// A tick that used more than a period of processor time, compared with others that did the same
/// work: the same number of pieces of the proxy's path, of primitives, and of steps of
/// back-tracking.
struct LongTick {
  int64_t took_ns = 0;
  /// It had a page fault: caused by this program.
  bool page_faults = false;
  int substeps = 0, primitives = 0, newton_steps = 0;
  /// The number of ticks with the same work.
  uint64_t others = 0;
  double others_mean_ns = 0.0;
};

struct Report {
  uint64_t ticks = 0, touching = 0;
  Injected injected;
  /// Scenes exchanged, fields found, events sent.
  uint64_t scenes = 0, fields = 0, events = 0;
  std::array<uint64_t, 32> causes{};  ///< ticks by cause
  std::array<uint64_t, kMissCauses> misses{};
  /// The ticks, without the simulated device, which catches up after a wait. Those that used more
  /// than a period of processor time were missed because of this program alone.
  OwnTime own;
  /// Fixed arithmetic after each tick, in the same thread, without memory access. If it takes too
  /// long, the machine took the time (a host may stop a guest's processor without an effect on the
  /// guest's clocks).
  OwnTime yardstick;
  /// The first hundred long ticks.
  std::vector<LongTick> long_ticks;
  /// True if no long tick had a page fault and each did work that many others did in a tenth of a
  /// period: then the time was lost elsewhere.
  bool long_ticks_explained() const;
  /// The heap in use by the process: after the first quarter, its maximum after that, and at the
  /// end.
  int64_t heap_early_bytes = 0, heap_most_bytes = 0, heap_end_bytes = 0;
  /// Violations of what must always hold: a force that is not finite, too large, too fast, or still
  /// there during a fault of the device; a cause without a name. With the first tick.
  std::vector<std::string> broken;

  uint64_t all_misses() const;
};

/// Runs it. Blocks for options.seconds of real time.
Report run(const Options& options);

/// The report as text, one line each.
std::string text(const Report& report);

}  // namespace palpate::soak
