#pragma once

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "compute/volume/field.h"
#include "compute/volume/volume.h"

namespace palpate::files {

/// 5 x 4 x 3 samples, three different spacings, rotated about all axes: any confusion of axes is
/// detected.
inline Grid oblique_grid() {
  Grid grid;
  grid.size = {5, 4, 3};
  grid.spacing_mm = {0.75, 1.25, 2.5};
  grid.origin_mm = {-31.5, 12.25, 170.125};
  const double a = 0.4, b = -0.7, c = 1.1;
  const glm::dmat3 about_x(1, 0, 0, 0, std::cos(a), std::sin(a), 0, -std::sin(a), std::cos(a));
  const glm::dmat3 about_y(std::cos(b), 0, -std::sin(b), 0, 1, 0, std::sin(b), 0, std::cos(b));
  const glm::dmat3 about_z(std::cos(c), std::sin(c), 0, -std::sin(c), std::cos(c), 0, 0, 0, 1);
  grid.direction = about_z * about_y * about_x;
  return grid;
}

inline Grid straight_grid(glm::ivec3 size = {5, 4, 3}) {
  Grid grid;
  grid.size = size;
  grid.spacing_mm = {0.75, 1.25, 2.5};
  grid.origin_mm = {-31.5, 12.25, 170.125};
  return grid;
}

/// A different integer in [0, 250] at (nearly) every voxel of every frame: exact in all sample
/// types.
inline float known_value(size_t voxel, size_t frame) {
  return float((voxel * 7 + frame * 31) % 251);
}

inline Volume known_volume(const Grid& grid, size_t frame = 0) {
  Volume volume{grid, std::vector<float>(grid.count())};
  for (size_t v = 0; v < volume.values.size(); ++v) volume.values[v] = known_value(v, frame);
  return volume;
}

/// A smooth field of a few mm that is different along every axis.
inline Field known_field(const Grid& grid) {
  Field field{grid, std::vector<glm::vec3>(grid.count())};
  for (int k = 0; k < grid.size.z; ++k) {
    for (int j = 0; j < grid.size.y; ++j) {
      for (int i = 0; i < grid.size.x; ++i) {
        field.u_mm[grid.offset(i, j, k)] = {0.3 * i - 0.5 + 0.05 * k, 0.2 * j * k - 1.0,
                                            0.7 - 0.25 * i * j};
      }
    }
  }
  return field;
}

/// Bytes of samples of type T, little endian.
template <class T>
std::string bytes_of_values(const std::vector<float>& values) {
  std::string bytes;
  for (const float value : values) {
    const T sample = T(value);
    char raw[sizeof(T)];
    std::memcpy(raw, &sample, sizeof(T));
    bytes.append(raw, sizeof(T));
  }
  return bytes;
}

}  // namespace palpate::files
