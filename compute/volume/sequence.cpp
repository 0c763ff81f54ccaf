#include "compute/volume/sequence.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr double kAllFrames_s = 1.0, kMostFramesPerSecond = 30.0;
constexpr double kSameTime_s = 1e-6;

}  // namespace

std::vector<double> assumed_times(size_t frames) {
  const double step_s = std::max(kAllFrames_s / double(frames), 1.0 / kMostFramesPerSecond);
  std::vector<double> times_s(frames);
  for (size_t k = 0; k < frames; ++k) times_s[k] = double(k) * step_s;
  return times_s;
}

bool are_assumed_times(const std::vector<double>& times_s) {
  const std::vector<double> assumed = assumed_times(times_s.size());
  return std::equal(times_s.begin(), times_s.end(), assumed.begin(),
                    [](double a, double b) { return std::abs(a - b) < kSameTime_s; });
}

}  // namespace palpate
