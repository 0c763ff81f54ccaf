#pragma once

#include <algorithm>
#include <glm/glm.hpp>

#include "compute/volume/grid.h"
#include "module/scene/transform.h"

namespace palpate {

/// How a grid lies in volume space (m, y up): index = index_from_volume * x + offset. Used by all
/// that is sampled and felt. Values; real-time safe.
struct GridPlace {
  glm::dmat3 index_from_volume{1.0};
  glm::dvec3 offset{0.0};
  glm::ivec3 size{0};

  GridPlace() = default;
  explicit GridPlace(const Grid& grid) : size(grid.size) {
    const glm::dvec3 x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
    const auto column = [&](glm::dvec3 axis) {
      return glm::transpose(grid.direction) * lps_from_volume(axis) / grid.spacing_mm;
    };
    index_from_volume = glm::dmat3(column(x), column(y), column(z));
    offset = grid.index_from_lps(glm::dvec3(0.0));
  }

  glm::dvec3 index(glm::dvec3 x_m) const noexcept { return index_from_volume * x_m + offset; }
  /// d value / dx from d value / d index.
  glm::dvec3 gradient(glm::dvec3 per_index) const noexcept {
    return {glm::dot(index_from_volume[0], per_index), glm::dot(index_from_volume[1], per_index),
            glm::dot(index_from_volume[2], per_index)};
  }
};

/// Where a continuous index lies between two samples of one axis.
struct AxisPlace {
  int low;        ///< the lower sample
  int step;       ///< to the upper one: 1, or 0 on an axis of one sample
  double weight;  ///< of the upper one
  double inside;  ///< 1 between the outermost samples, 0 beyond: there the border is clamped

  AxisPlace(double index, int size) noexcept {
    // In this order NaN becomes 0, so that no caller's mistake reads outside the samples.
    const double clamped = std::max(0.0, std::min(index, double(size - 1)));
    step = size > 1;
    low = std::min(int(clamped), size - 1 - step);
    weight = clamped - double(low);
    inside = clamped == index ? 1.0 : 0.0;
  }
};

}  // namespace palpate
