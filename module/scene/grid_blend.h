#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "module/scene/grid_place.h"

/// Values and continuous gradients between the samples of a grid. What sampled scalars and vectors
/// share; Load is a function of a sample's offset, T its type: anything that can be added and
/// multiplied by a double from the left.
namespace palpate::blend {

/// Value and derivative per index of each axis.
template <class T>
struct Blend {
  T value, x, y, z;
};

/// The trilinear value; the border is held.
template <class T, class Load>
T value(const GridPlace& place, glm::dvec3 index, const Load& load) noexcept {
  const AxisPlace x(index.x, place.size.x), y(index.y, place.size.y), z(index.z, place.size.z);
  const size_t nx = size_t(place.size.x), slice = nx * size_t(place.size.y);
  const size_t base = size_t(x.low) + nx * size_t(y.low) + slice * size_t(z.low);
  const size_t to_x = size_t(x.step), to_y = nx * size_t(y.step), to_z = slice * size_t(z.step);
  const auto row = [&](size_t at) {
    const T low = load(at);
    return low + x.weight * (load(at + to_x) - low);
  };
  const auto plane = [&](size_t at) {
    const T low = row(at);
    return low + y.weight * (row(at + to_y) - low);
  };
  const T low = plane(base);
  return low + z.weight * (plane(base + to_z) - low);
}

/// The four samples around an index on one axis: offsets, weights of the value (the middle two) and
/// of the derivative: the blend of the central differences at the middle two, one-sided where the
/// grid ends.
struct Taps {
  std::array<size_t, 4> offset;
  std::array<double, 4> linear, slope;

  Taps(double index, int size, size_t stride) noexcept {
    const AxisPlace at(index, size);
    const int last = size - 1, high = at.low + at.step;
    const int before = std::max(at.low - 1, 0), after = std::min(high + 1, last);
    offset = {size_t(before) * stride, size_t(at.low) * stride, size_t(high) * stride,
              size_t(after) * stride};
    const double w = at.weight;
    linear = {0.0, 1.0 - w, w, 0.0};
    const double per_low = at.step == 0 ? 0.0 : (1.0 - w) / double(high - before);
    const double per_high = at.step == 0 ? 0.0 : w / double(after - at.low);
    slope = {-per_low, -per_high, per_low, per_high};
  }
};

/// 1 within the outermost samples, falling to 0 over the half voxel to the end of the data: how
/// gradients fade out where the held border makes the value constant.
inline double fade(double index, int size) noexcept {
  const double beyond = std::max(-index, index - double(size - 1));
  const double shown = std::min(1.0 - 2.0 * beyond, 1.0);
  return shown > 0.0 ? shown : 0.0;  // also for NaN
}

/// Value and continuous derivative from one pass over the 32 of the 4 x 4 x 4 samples that count.
template <class T, class Load>
Blend<T> value_and_slopes(const GridPlace& place, glm::dvec3 index, const Load& load) noexcept {
  const size_t nx = size_t(place.size.x);
  const Taps x(index.x, place.size.x, 1), y(index.y, place.size.y, nx),
      z(index.z, place.size.z, nx * size_t(place.size.y));
  const auto row = [&](size_t j, size_t k) {
    const size_t at = y.offset[j] + z.offset[k];
    return x.linear[1] * load(at + x.offset[1]) + x.linear[2] * load(at + x.offset[2]);
  };
  const auto row_slope = [&](size_t j, size_t k) {
    const size_t at = y.offset[j] + z.offset[k];
    return x.slope[0] * load(at + x.offset[0]) + x.slope[1] * load(at + x.offset[1]) +
           x.slope[2] * load(at + x.offset[2]) + x.slope[3] * load(at + x.offset[3]);
  };
  const T v11 = row(1, 1), v21 = row(2, 1), v12 = row(1, 2), v22 = row(2, 2);
  // Planes of constant z, and the slope along y in the middle two.
  const T near = y.linear[1] * v11 + y.linear[2] * v21;
  const T far = y.linear[1] * v12 + y.linear[2] * v22;
  const T before = y.linear[1] * row(1, 0) + y.linear[2] * row(2, 0);
  const T after = y.linear[1] * row(1, 3) + y.linear[2] * row(2, 3);
  const T y_near =
      y.slope[0] * row(0, 1) + y.slope[1] * v11 + y.slope[2] * v21 + y.slope[3] * row(3, 1);
  const T y_far =
      y.slope[0] * row(0, 2) + y.slope[1] * v12 + y.slope[2] * v22 + y.slope[3] * row(3, 2);
  const T x_near = y.linear[1] * row_slope(1, 1) + y.linear[2] * row_slope(2, 1);
  const T x_far = y.linear[1] * row_slope(1, 2) + y.linear[2] * row_slope(2, 2);
  const double shown =
      fade(index.x, place.size.x) * fade(index.y, place.size.y) * fade(index.z, place.size.z);
  const double lz1 = shown * z.linear[1], lz2 = shown * z.linear[2];
  return {
      z.linear[1] * near + z.linear[2] * far, lz1 * x_near + lz2 * x_far,
      lz1 * y_near + lz2 * y_far,
      shown * (z.slope[0] * before + z.slope[1] * near + z.slope[2] * far + z.slope[3] * after)};
}

}  // namespace palpate::blend
