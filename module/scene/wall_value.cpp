#include "module/scene/wall_value.h"

#include <algorithm>
#include <array>

namespace palpate {

WallValue value_between_groups(const Volume& frame) {
  const auto [low, high] = std::minmax_element(frame.values.begin(), frame.values.end());
  if (low == frame.values.end() || !(*high > *low))
    return {frame.values.empty() ? 0.0 : double(*low), 0.0};
  constexpr int kBins = 512;
  std::array<double, kBins> bins{};
  const double first = *low, width = (double(*high) - first) / kBins;
  for (const float value : frame.values)
    bins[size_t(std::clamp(int((value - first) / width), 0, kBins - 1))] += 1.0;
  double all = 0.0, sum = 0.0;
  for (int b = 0; b < kBins; ++b) all += bins[size_t(b)], sum += bins[size_t(b)] * b;
  double below = 0.0, sum_below = 0.0, best = -1.0;
  WallValue surface;
  for (int b = 0; b + 1 < kBins; ++b) {
    below += bins[size_t(b)];
    sum_below += bins[size_t(b)] * b;
    if (below == 0.0 || below == all) continue;
    const double mean_below = sum_below / below;
    const double mean_above = (sum - sum_below) / (all - below);
    const double between =
        below * (all - below) * (mean_above - mean_below) * (mean_above - mean_below);
    if (between <= best) continue;
    best = between;
    surface.level = first + width * 0.5 * (mean_below + mean_above + 1.0);
    surface.width = 0.25 * width * (mean_above - mean_below);
  }
  return surface;
}

}  // namespace palpate
