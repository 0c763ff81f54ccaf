#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>

#include "module/scene/grid_place.h"
#include "module/scene/lanes.h"

/// Values and gradients between the samples of a grid by the cubic B-spline with given
/// coefficients: twice continuously differentiable, and gradients that are exactly those of the
/// values. A hand needs both. Trilinear values with blended central differences are not consistent:
/// on a sharp edge (1.5 voxels) around a ball of 25 voxels its normals are 0.10 rad (RMS) off the
/// ball's and cross the iso-surface, so that a sliding proxy digs in. The spline's, with the
/// samples as coefficients, are 0.03 off, and normal to what is felt. Samples as coefficients are
/// blurred by 0.58 voxels (the standard deviation of the spline): a surface of radius R lies h^2 /
/// (3 R) further in, and the value in a wall one voxel thick falls to two thirds;
/// spline_coefficients.h has better ones.
namespace palpate::spline {

/// Value and derivative per index of each axis.
template <class T>
struct Blend {
  T value, x, y, z;
};

/// The four samples of one axis that act on an index, and their weights. Beyond the ends the last
/// sample is repeated.
struct Taps {
  std::array<size_t, 4> offset;
  std::array<double, 4> weight, slope;
  int low;      ///< the second of the four, from -2 to the number of samples + 1
  bool inside;  ///< no sample is repeated: the four lie one after the other

  Taps(double index, int size, size_t stride) noexcept {
    // In this order NaN becomes the first sample. From two samples beyond the end on, everything is
    // constant.
    const double clamped = std::max(-2.0, std::min(index, double(size) + 1.0));
    low = int(clamped + 4.0) - 4;  // floor, since clamped >= -2
    const double t = clamped - low, u = 1.0 - t;
    for (int k = 0; k < 4; ++k) offset[k] = size_t(std::clamp(low - 1 + k, 0, size - 1)) * stride;
    inside = low >= 1 && low + 2 < size;
    weight = {u * u * u / 6.0, 2.0 / 3.0 - t * t * (1.0 - 0.5 * t),
              2.0 / 3.0 - u * u * (1.0 - 0.5 * u), t * t * t / 6.0};
    slope = {-0.5 * u * u, t * (1.5 * t - 2.0), -u * (1.5 * u - 2.0), 0.5 * t * t};
  }
};

/// The three axes' taps.
struct Around {
  Taps x, y, z;
  Around(const GridPlace& place, glm::dvec3 index) noexcept
      : x(index.x, place.size.x, 1),
        y(index.y, place.size.y, size_t(place.size.x)),
        z(index.z, place.size.z, size_t(place.size.x) * size_t(place.size.y)) {}
};

/// Any type of sample: load is a function of a sample's offset; T can be added, and multiplied by a
/// double from the left.
template <class T, class Load>
Blend<T> read(const Around& around, const Load& load) noexcept {
  Blend<T> sum{};
  for (int k = 0; k < 4; ++k) {
    T value{}, along_x{}, along_y{};
    for (int j = 0; j < 4; ++j) {
      const size_t row = around.z.offset[k] + around.y.offset[j];
      T of_row{}, slope{};
      for (int i = 0; i < 4; ++i) {
        const T sample = load(row + around.x.offset[i]);
        of_row = of_row + around.x.weight[i] * sample;
        slope = slope + around.x.slope[i] * sample;
      }
      value = value + around.y.weight[j] * of_row;
      along_x = along_x + around.y.weight[j] * slope;
      along_y = along_y + around.y.slope[j] * of_row;
    }
    sum.value = sum.value + around.z.weight[k] * value;
    sum.x = sum.x + around.z.weight[k] * along_x;
    sum.y = sum.y + around.z.weight[k] * along_y;
    sum.z = sum.z + around.z.slope[k] * value;
  }
  return sum;
}

/// Scalars, four along x at once: the same sums in single precision, with an error of an eighth of
/// a millionth of the largest sample.
inline Blend<double> read(const Around& around, const float* values) noexcept {
  if (!around.x.inside)
    return read<double>(around, [values](size_t at) { return double(values[at]); });
  using lanes::Float4;
  Float4 value{}, along_y{}, along_z{};
  const float* column = values + around.x.offset[0];
  for (int k = 0; k < 4; ++k) {
    Float4 plane{}, slope{};
    for (int j = 0; j < 4; ++j) {
      Float4 row;
      std::memcpy(&row, column + around.z.offset[k] + around.y.offset[j], sizeof row);
      plane += float(around.y.weight[j]) * row;
      slope += float(around.y.slope[j]) * row;
    }
    value += float(around.z.weight[k]) * plane;
    along_y += float(around.z.weight[k]) * slope;
    along_z += float(around.z.slope[k]) * plane;
  }
  Blend<double> sum{};
  for (int i = 0; i < 4; ++i) {
    sum.value += around.x.weight[i] * double(value[i]);
    sum.x += around.x.slope[i] * double(value[i]);
    sum.y += around.x.weight[i] * double(along_y[i]);
    sum.z += around.x.weight[i] * double(along_z[i]);
  }
  return sum;
}

}  // namespace palpate::spline
