#include "compute/motion/noise.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "compute/motion/selection.h"
#include "compute/volume/parallel.h"

namespace palpate {
namespace {

/// Gives a median that is accurate to half a per cent.
constexpr size_t kNoiseSamples = 200000;
constexpr size_t kLeastCells = 64;  // nothing is told from fewer

/// The product of second differences at one sample. flat: all neighbours along the axes are equal
/// to it.
struct Filtered {
  double value;
  bool flat;
};

Filtered second_differences(const Volume& volume, glm::ivec3 at, glm::ivec3 reach) {
  const float centre = volume.at(at.x, at.y, at.z);
  Filtered result{0.0, true};
  for (int k = -reach.z; k <= reach.z; ++k) {
    const double weight_k = reach.z && k == 0 ? -2.0 : 1.0;
    for (int j = -reach.y; j <= reach.y; ++j) {
      const double weight = weight_k * (reach.y && j == 0 ? -2.0 : 1.0);
      const float* row = &volume.values[volume.grid.offset(at.x, at.y + j, at.z + k)];
      const float before = row[-reach.x], here = row[0], after = row[reach.x];
      result.value +=
          weight * (reach.x ? double(before) - 2.0 * double(here) + double(after) : double(here));
      result.flat = result.flat && before == centre && here == centre && after == centre;
    }
  }
  return result;
}

}  // namespace

double noise_sd(const Volume& volume) {
  const glm::ivec3 size = volume.grid.size;
  glm::ivec3 reach(0);
  double gain = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    if (size[axis] < 3) continue;
    reach[axis] = 1;
    gain *= std::sqrt(6.0);
  }
  const glm::ivec3 inner = size - 2 * reach;
  const size_t count = size_t(inner.x) * size_t(inner.y) * size_t(inner.z);
  if (gain == 1.0 || count == 0) return 0.0;
  // An odd stride, so that it is no multiple of an even row length.
  const size_t every = (count / kNoiseSamples) | 1U;
  constexpr float kNone = -1.0F;
  std::vector<float> magnitudes((count + every - 1) / every);
  parallel_ranges(int(magnitudes.size()), 50.0, [&](int begin, int end) {
    for (int sample = begin; sample < end; ++sample) {
      const size_t n = size_t(sample) * every;
      const glm::ivec3 at(int(n % size_t(inner.x)), int(n / size_t(inner.x) % size_t(inner.y)),
                          int(n / size_t(inner.x) / size_t(inner.y)));
      const Filtered filtered = second_differences(volume, at + reach, reach);
      const bool counts = !filtered.flat && std::isfinite(filtered.value);
      magnitudes[size_t(sample)] = counts ? float(std::abs(filtered.value)) : kNone;
    }
  });
  std::erase(magnitudes, kNone);
  if (magnitudes.empty()) return 0.0;
  return 1.4826 * double(at_ranks<1>(magnitudes, {magnitudes.size() / 2})[0]) / gain;
}

std::optional<double> noise_left(std::vector<CellLeft> cells) {
  constexpr size_t kGroups = 8;
  if (cells.size() < kLeastCells) return std::nullopt;
  std::sort(cells.begin(), cells.end(),
            [](const CellLeft& a, const CellLeft& b) { return a.structure < b.structure; });
  // Normal equations of the fit of r^2 = W x + R y.
  double xx = 0.0, xy = 0.0, yy = 0.0, xr = 0.0, yr = 0.0;
  for (size_t g = 0; g < kGroups; ++g) {
    const auto begin = cells.begin() + std::ptrdiff_t(cells.size() * g / kGroups);
    const auto end = cells.begin() + std::ptrdiff_t(cells.size() * (g + 1) / kGroups);
    const double q = std::min(1.0F, begin[(end - begin) / 2].structure);
    const auto quartile = begin + (end - begin) / 4;
    std::nth_element(begin, quartile, end, [](const CellLeft& a, const CellLeft& b) {
      return a.difference < b.difference;
    });
    const double x = 1.0 - q, y = 2.0 * q, r = quartile->difference;
    xx += x * x;
    xy += x * y;
    yy += y * y;
    xr += x * r;
    yr += y * r;
  }
  const double determinant = xx * yy - xy * xy;
  const double motion = determinant > 0.0 ? (xx * yr - xy * xr) / determinant : 0.0;
  if (motion <= 0.0) return xx > 0.0 ? xr / xx : 0.0;
  return std::max(0.0, (yy * xr - xy * yr) / determinant);
}

bool cells_share_noise(std::vector<CellNoise> cells) {
  // Between a PET scan that was enlarged (k 6.8, u 0.57; the thorax MR so: 3.4, 0.21) and images
  // without noise in motion that was not found (k 5 to 12, u at most 0.15).
  constexpr float kCorrelated = 3.0F, kDifferent = 0.18F;
  if (cells.size() < kLeastCells) return true;
  const auto quarter = cells.begin() + std::ptrdiff_t(cells.size() / 4);
  std::nth_element(cells.begin(), quarter, cells.end(), [](const CellNoise& a, const CellNoise& b) {
    return a.structure < b.structure;
  });
  const auto median = [&](float CellNoise::*what) {
    const auto middle = cells.begin() + (quarter - cells.begin()) / 2;
    std::nth_element(cells.begin(), middle, quarter,
                     [&](const CellNoise& a, const CellNoise& b) { return a.*what < b.*what; });
    return (*middle).*what;
  };
  return median(&CellNoise::correlated) > kCorrelated && median(&CellNoise::different) > kDifferent;
}

}  // namespace palpate
