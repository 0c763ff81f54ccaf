#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "compute/volume/grid.h"
#include "compute/volume/parallel.h"

/// Trilinear interpolation of samples with any number of channels: shared by volume.cpp and
/// field.cpp.
namespace palpate::interpolation {

/// The two neighbours of a continuous index on one axis and the weight of the upper one; clamped at
/// the border.
struct LinearTaps {
  int low = 0;
  int high = 0;
  float weight = 0.0F;
};

inline LinearTaps taps(double index, int size) {
  // In this order NaN becomes 0, so that no caller's mistake reads outside the samples.
  const double inside = std::max(0.0, std::min(index, double(size - 1)));
  const int low = std::min(int(inside), std::max(0, size - 2));
  return {low, std::min(low + 1, size - 1), float(inside - low)};
}

/// Trilinear value at a continuous index, written to out[0 .. channels).
template <int channels>
void sample_at(const float* values, const Grid& grid, glm::dvec3 index, double* out) {
  const LinearTaps x = taps(index.x, grid.size.x);
  const LinearTaps y = taps(index.y, grid.size.y);
  const LinearTaps z = taps(index.z, grid.size.z);
  const auto row = [&](int j, int k, int c) {
    const float* start = values + grid.offset(0, j, k) * channels + c;
    const double low = start[size_t(x.low) * channels];
    return low + double(x.weight) * (start[size_t(x.high) * channels] - low);
  };
  for (int c = 0; c < channels; ++c) {
    const double near = row(y.low, z.low, c);
    const double front = near + double(y.weight) * (row(y.high, z.low, c) - near);
    const double far = row(y.low, z.high, c);
    const double back = far + double(y.weight) * (row(y.high, z.high, c) - far);
    out[c] = front + double(z.weight) * (back - front);
  }
}

inline bool parallel_axes(const Grid& a, const Grid& b) {
  double apart = 0.0;
  for (int column = 0; column < 3; ++column) {
    apart = std::max(apart, glm::length(a.direction[column] - b.direction[column]));
  }
  // A thousandth of a voxel across the longest axis, the tolerance of same_geometry.
  const int longest = std::max({b.size.x, b.size.y, b.size.z});
  return apart * longest < 1e-3;
}

inline std::vector<LinearTaps> axis_taps(double first, double step, int count, int size) {
  std::vector<LinearTaps> result;
  result.reserve(size_t(count));
  for (int i = 0; i < count; ++i) result.push_back(taps(first + step * i, size));
  return result;
}

/// Both grids have the same axes, so the weights of one axis hold for all rows: blend the four
/// source rows into one (plain vector code), then interpolate along it.
template <int channels>
void resample_parallel(const float* values, const Grid& from, const Grid& onto, float* out) {
  const glm::dvec3 first = from.index_from_lps(onto.origin_mm);
  const glm::dvec3 step = onto.spacing_mm / from.spacing_mm;
  const std::vector<LinearTaps> tx = axis_taps(first.x, step.x, onto.size.x, from.size.x);
  const std::vector<LinearTaps> ty = axis_taps(first.y, step.y, onto.size.y, from.size.y);
  const std::vector<LinearTaps> tz = axis_taps(first.z, step.z, onto.size.z, from.size.z);
  const size_t length = size_t(from.size.x) * channels;
  const double slice_cost = 4.0 * channels * onto.size.y * double(onto.size.x + from.size.x);
  parallel_ranges(onto.size.z, slice_cost, [&](int begin, int end) {
    std::vector<float> blended(length);
    for (int k = begin; k < end; ++k) {
      for (int j = 0; j < onto.size.y; ++j) {
        const LinearTaps& y = ty[size_t(j)];
        const LinearTaps& z = tz[size_t(k)];
        const float* a = values + from.offset(0, y.low, z.low) * channels;
        const float* b = values + from.offset(0, y.high, z.low) * channels;
        const float* c = values + from.offset(0, y.low, z.high) * channels;
        const float* d = values + from.offset(0, y.high, z.high) * channels;
        const float wy = y.weight;
        const float wz = z.weight;
        for (size_t i = 0; i < length; ++i) {
          const float near = a[i] + wy * (b[i] - a[i]);
          const float far = c[i] + wy * (d[i] - c[i]);
          blended[i] = near + wz * (far - near);
        }
        float* target = out + onto.offset(0, j, k) * channels;
        for (int i = 0; i < onto.size.x; ++i) {
          const LinearTaps& x = tx[size_t(i)];
          const float* low = blended.data() + size_t(x.low) * channels;
          const float* high = blended.data() + size_t(x.high) * channels;
          for (int channel = 0; channel < channels; ++channel) {
            *target++ = low[channel] + x.weight * (high[channel] - low[channel]);
          }
        }
      }
    }
  });
}

/// Any two grids: sample by sample through physical space.
template <int channels>
void resample_general(const float* values, const Grid& from, const Grid& onto, float* out) {
  const double slice_cost = 30.0 * channels * onto.size.x * onto.size.y;
  parallel_ranges(onto.size.z, slice_cost, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      for (int j = 0; j < onto.size.y; ++j) {
        float* target = out + onto.offset(0, j, k) * channels;
        for (int i = 0; i < onto.size.x; ++i) {
          double value[channels];
          const glm::dvec3 lps_mm = onto.lps_from_index(glm::dvec3(i, j, k));
          sample_at<channels>(values, from, from.index_from_lps(lps_mm), value);
          for (int channel = 0; channel < channels; ++channel) *target++ = float(value[channel]);
        }
      }
    }
  });
}

/// Interleaved samples of `from` on the grid `onto`, trilinear in physical space, border values
/// clamped outside.
template <int channels>
void resample(const float* values, const Grid& from, const Grid& onto, float* out) {
  if (parallel_axes(from, onto)) {
    resample_parallel<channels>(values, from, onto, out);
  } else {
    resample_general<channels>(values, from, onto, out);
  }
}

}  // namespace palpate::interpolation
