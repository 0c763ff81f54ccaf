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

struct Report {
  uint64_t ticks = 0, touching = 0;
  Injected injected;
  uint64_t scenes = 0, fields = 0, events = 0;  ///< handed over, found, sent
  std::array<uint64_t, 32> causes{};            ///< ticks by cause
  std::array<uint64_t, kMissCauses> misses{};
  /// Ticks that used more than a period of processor time by themselves: what was missed then
  /// nobody else is to blame for. (Not the simulated device: after a wait it catches up.)
  uint64_t own_long = 0;
  int64_t longest_own_ns = 0;
  /// Heap in use by the process after the first quarter, at its most after that, and at the end.
  int64_t heap_early_bytes = 0, heap_most_bytes = 0, heap_end_bytes = 0;
  /// What must never be and was: a force that is no number, too large, too fast, still there while
  /// the device is at fault, a cause that is not named. With the tick it was first seen in.
  std::vector<std::string> broken;

  uint64_t all_misses() const;
};

/// Runs it. Blocks for options.seconds of real time.
Report run(const Options& options);

/// For people: a line each.
std::string text(const Report& report);

}  // namespace palpate::soak
