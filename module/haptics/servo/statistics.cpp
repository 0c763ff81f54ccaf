#include "module/haptics/servo/statistics.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace palpate {

int Histogram::bin_of(int64_t time_ns) noexcept {
  if (time_ns < kExact) return int(std::max<int64_t>(time_ns, 0));
  const int top = int(std::bit_width(uint64_t(time_ns))) - 1;
  if (top >= kTopBit) return kBins - 1;
  // The six bits below the highest one choose the bin within the octave.
  return kExact + kPerOctave * (top - 7) + int((time_ns >> (top - 6)) & (kPerOctave - 1));
}

int64_t Histogram::last_of(int bin) noexcept {
  if (bin < kExact) return bin;
  const int top = 7 + (bin - kExact) / kPerOctave, part = (bin - kExact) % kPerOctave;
  return (int64_t(kPerOctave + part + 1) << (top - 6)) - 1;
}

void Histogram::add(int64_t time_ns) noexcept {
  time_ns = std::clamp<int64_t>(time_ns, 0, int64_t(1) << kTopBit);
  count_up(bins_[bin_of(time_ns)]);
  sum_.store(sum_.load(std::memory_order_relaxed) + time_ns, std::memory_order_relaxed);
  if (time_ns > most_.load(std::memory_order_relaxed))
    most_.store(time_ns, std::memory_order_relaxed);
}

uint64_t Histogram::count() const noexcept {
  uint64_t all = 0;
  for (int bin = 0; bin < kBins; ++bin) all += in_bin(bin);
  return all;
}

double Histogram::mean_ns() const noexcept {
  const uint64_t all = count();
  return all == 0 ? 0.0 : double(sum_.load(std::memory_order_relaxed)) / double(all);
}

int64_t Histogram::quantile_ns(double q) const noexcept {
  const uint64_t all = count();
  if (all == 0) return 0;
  const auto rank =
      std::max<uint64_t>(1, uint64_t(std::ceil(std::clamp(q, 0.0, 1.0) * double(all))));
  uint64_t seen = 0;
  for (int bin = 0; bin < kBins; ++bin) {
    seen += in_bin(bin);
    if (seen >= rank) return std::min(last_of(bin), most_ns());
  }
  return most_ns();
}

const char* word(MissCause cause) noexcept {
  switch (cause) {
    case MissCause::kWokeLate:
      return "woke-late";
    case MissCause::kTickLong:
      return "tick-long";
    case MissCause::kDeviceLong:
      return "device-long";
    case MissCause::kClock:
      return "clock";
  }
  return "unknown";
}

uint64_t ServoStatistics::all_misses() const noexcept {
  uint64_t all = 0;
  for (const auto& counter : misses) all += counter.load(std::memory_order_relaxed);
  return all;
}

}  // namespace palpate
