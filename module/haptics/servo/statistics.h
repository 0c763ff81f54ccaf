#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace palpate {

/// A histogram of times. Exact below 128 ns, then 64 bins per factor of two: quantiles are within
/// 1.6 %. One thread adds, others may read meanwhile: they may miss the newest ticks, but never
/// read a torn number. No lock, no allocation.
class Histogram {
 public:
  /// Negative times count as 0, those above 2^40 ns (18 minutes) as 2^40 ns. Real-time safe.
  void add(int64_t time_ns) noexcept;

  uint64_t count() const noexcept;
  /// The time that the share `q` of all times does not exceed (upper end of its bin, never above
  /// most()), ns; 0 if there are none.
  int64_t quantile_ns(double q) const noexcept;
  int64_t most_ns() const noexcept { return most_.load(std::memory_order_relaxed); }
  double mean_ns() const noexcept;

  static constexpr int kExact = 128, kPerOctave = 64, kTopBit = 40;
  static constexpr int kBins = kExact + kPerOctave * (kTopBit - 7) + 1;
  static int bin_of(int64_t time_ns) noexcept;
  /// Largest time that falls into the bin.
  static int64_t last_of(int bin) noexcept;
  uint64_t in_bin(int bin) const noexcept { return bins_[bin].load(std::memory_order_relaxed); }

 private:
  std::array<std::atomic<uint64_t>, kBins> bins_{};
  std::atomic<int64_t> most_{0}, sum_{0};
};

/// Why a tick began more than half a period after its deadline.
enum class MissCause : uint8_t {
  kWokeLate,    ///< the system woke the thread too late
  kTickLong,    ///< the tick before took too long
  kDeviceLong,  ///< the device took too long to answer
  kClock,       ///< the clock went backwards
};
inline constexpr int kMissCauses = 4;

/// One word for tables ("woke-late"). Static storage.
const char* word(MissCause cause) noexcept;

/// What the servo loop counts about itself. Written by the servo thread, read by any.
struct ServoStatistics {
  Histogram period;    ///< from one wake-up to the next
  Histogram lateness;  ///< of the wake-up behind its deadline
  Histogram tick;      ///< the tick alone
  Histogram device;    ///< one exchange
  Histogram work;      ///< all the work of a period, from waking to done
  std::array<std::atomic<uint64_t>, kMissCauses> misses{};
  std::atomic<uint64_t> ticks{0};
  std::atomic<uint64_t> late{0};        ///< ticks that the watchdog called late
  std::atomic<uint64_t> not_finite{0};  ///< forces of the tick that were not finite: ramped to zero
  std::atomic<bool> twice{false};       ///< two exchanges per period now

  uint64_t all_misses() const noexcept;
};

/// Adds one; for counters that one thread writes: cheaper than an atomic addition.
inline void count_up(std::atomic<uint64_t>& counter) noexcept {
  counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
}

}  // namespace palpate
