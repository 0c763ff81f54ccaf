#include "module/scene/spline_coefficients.h"

#include <algorithm>
#include <cmath>

#include "compute/volume/parallel.h"

namespace palpate {
namespace {

constexpr double kMiddle = 134.0 / 240.0, kNext = 84.0 / 240.0, kFar = -31.0 / 240.0;

/// `count` rows of `width` samples, `stride` apart: filtered across the rows.
void filter_rows(float* rows, size_t count, size_t stride, size_t width,
                 std::vector<float>& before) {
  before.resize(count * width);
  for (size_t r = 0; r < count; ++r)
    std::copy_n(rows + r * stride, width, before.data() + r * width);
  for (size_t r = 2; r + 2 < count; ++r) {
    const float* from = before.data() + (r - 2) * width;
    float* to = rows + r * stride;
    for (size_t i = 0; i < width; ++i) {
      const auto at = [&](size_t row) { return double(from[row * width + i]); };
      const double sum = kMiddle * at(2) + kNext * (at(1) + at(3)) + kFar * (at(0) + at(4));
      if (std::isfinite(sum)) to[i] = float(sum);
    }
  }
}

}  // namespace

Volume spline_coefficients(Volume volume) {
  const glm::ivec3 size = volume.grid.size;
  const size_t row = size_t(size.x), slice = row * size_t(size.y);
  const auto each = [&](int axis, int parts, size_t apart, size_t stride, size_t width) {
    const int count = size[axis];
    if (count < 5) return;
    parallel_ranges(parts, 8.0 * double(count) * double(width), [&](int begin, int end) {
      std::vector<float> before;
      for (int p = begin; p < end; ++p)
        filter_rows(volume.values.data() + size_t(p) * apart, size_t(count), stride, width, before);
    });
  };
  each(0, size.y * size.z, row, 1, 1);
  each(1, size.z, slice, row, row);
  each(2, size.y, row, slice, row);
  return volume;
}

}  // namespace palpate
