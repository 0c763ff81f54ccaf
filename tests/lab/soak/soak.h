#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "module/haptics/cause.h"
#include "module/haptics/device.h"
#include "module/haptics/statistics.h"

namespace palpate::vulkan {
class Context;
}

/// The main job for as long as one likes, with everything that may go wrong: the real servo thread
/// and clock, the haptic step with all its guards, a simulated hand on a beating heart, scenes and
/// fields handed over while it runs, and a device that fails at random.
namespace palpate::soak {

struct Options {
  double seconds = 20.0;
  uint32_t seed = 1;
  /// Where the fields that are handed over are estimated, from noisy frames; null: the true fields.
  std::shared_ptr<vulkan::Context> context;
  /// Now and then, for a person: seconds gone, the share that is done.
  std::function<void(double seconds)> progress;
};

/// What a device did to the loop, how often.
struct Injected {
  uint64_t unplugged = 0, timeouts = 0, garbage = 0, jumps = 0, not_numbers = 0, stale = 0,
           stalls = 0, clock_back = 0;
  uint64_t all() const {
    return unplugged + timeouts + garbage + jumps + not_numbers + stale + stalls + clock_back;
  }
};

/// Processor time of what is done again and again in one thread.
struct OwnTime {
  uint64_t count = 0;  ///< times that it took more than a period
  int64_t longest_ns = 0, all_ns = 0;
};

/// A tick that used more than a period of processor time, beside others that did the same work: as
/// many pieces of the proxy's path, primitives and steps of back-tracking.
struct LongTick {
  int64_t took_ns = 0;
  bool page_faults = false;  ///< it fetched a page of memory: our doing
  int substeps = 0, primitives = 0, newton_steps = 0;
  uint64_t others = 0;  ///< ticks with the same work
  double others_mean_ns = 0.0;
};

struct Report {
  uint64_t ticks = 0, touching = 0;
  Injected injected;
  uint64_t scenes = 0, fields = 0, events = 0;  ///< handed over, found, sent
  std::array<uint64_t, 32> causes{};            ///< ticks by cause
  std::array<uint64_t, kMissCauses> misses{};
  /// The ticks, without the simulated device, which catches up after a wait: those that used more
  /// than a period of processor time by themselves were missed by nobody else's fault.
  OwnTime own;
  /// Fixed arithmetic after each tick, in the same thread, which touches no memory: what it takes
  /// too long for, the machine has taken from it (a guest's processor is stopped by its host
  /// without the guest's clocks knowing).
  OwnTime yardstick;
  /// The long ticks, the first hundred of them.
  std::vector<LongTick> long_ticks;
  /// True if each long tick fetched no page of memory and did work that many others did in a tenth
  /// of a period: then the time went elsewhere.
  bool long_ticks_explained() const;
  /// Heap in use by the process after the first quarter, at its most after that, and at the end.
  int64_t heap_early_bytes = 0, heap_most_bytes = 0, heap_end_bytes = 0;
  /// What must never be and was: a force that is not finite, too large, too fast, still there while
  /// the device is at fault, a cause that is not named. With the tick it was first seen in.
  std::vector<std::string> broken;

  uint64_t all_misses() const;
};

/// Runs it. Blocks for options.seconds of real time.
Report run(const Options& options);

/// For people: a line each.
std::string text(const Report& report);

}  // namespace palpate::soak
