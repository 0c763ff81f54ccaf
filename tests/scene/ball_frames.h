#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <vector>

#include "compute/volume/volume.h"
#include "tests/support/random.h"

namespace palpate::test {

/// Frames of 64 mm edge around the origin with a ball in them.

constexpr double kBallRadius_mm = 18.0;

/// A frame with the value of a function of LPS mm at each voxel centre.
template <class Value>
Volume frame_of(const Value& value, glm::dvec3 spacing_mm = glm::dvec3(1.0)) {
  Volume volume;
  volume.grid.size = glm::ivec3(glm::round(64.0 / spacing_mm));
  volume.grid.spacing_mm = spacing_mm;
  volume.grid.origin_mm = -0.5 * spacing_mm * glm::dvec3(volume.grid.size - 1);
  const glm::ivec3 n = volume.grid.size;
  for (int k = 0; k < n.z; ++k)
    for (int j = 0; j < n.y; ++j)
      for (int i = 0; i < n.x; ++i)
        volume.values.push_back(float(value(volume.grid.lps_from_index({i, j, k}))));
  return volume;
}

/// From 0 to 1 over some millimetres, as a border blurred by a scanner.
inline double edge(double inside_mm) {
  return 0.5 + 0.5 * std::erf(inside_mm / std::sqrt(2.0));
}

/// A ball in spots of 4 mm, as speckle: its iso-surface is full of holes.
inline Volume spotted_ball() {
  Random random(3);
  std::vector<double> spots(16 * 16 * 16);
  for (double& spot : spots) spot = random.draw(-70.0, 70.0);
  return frame_of([&](glm::dvec3 x) {
    const glm::ivec3 cell = glm::ivec3(x + 31.5) / 4;
    return 100.0 + 100.0 * edge(kBallRadius_mm - glm::length(x)) +
           spots[size_t(cell.x + 16 * (cell.y + 16 * cell.z))];
  });
}

}  // namespace palpate::test
