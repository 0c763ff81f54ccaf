#pragma once

#include <cstdint>

#include "compute/volume/field.h"
#include "compute/volume/phantom_texture.h"
#include "compute/volume/volume.h"
#include "tests/volume/grids.h"

namespace palpate::test {

/// A field whose value at every sample is a function of the LPS position.
template <class Function>
Field field_of(const Grid& grid, const Function& u_mm) {
  Field field = still_field(grid);
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i)
        field.u_mm[grid.offset(i, j, k)] = glm::vec3(u_mm(grid.lps_from_index({i, j, k})));
  return field;
}

template <class Function>
Volume volume_of(const Grid& grid, const Function& value) {
  Volume volume{grid, std::vector<float>(grid.count())};
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i)
        volume.values[grid.offset(i, j, k)] = float(value(grid.lps_from_index({i, j, k})));
  return volume;
}

/// size^3 samples; the first is at the LPS origin.
inline Grid grid_at_origin(int size, double spacing_mm = 1.0) {
  Grid grid;
  grid.size = glm::ivec3(size);
  grid.spacing_mm = glm::dvec3(spacing_mm);
  return grid;
}

/// A mask of all samples but a border of `margin` samples.
inline Mask whole(const Grid& grid, int margin = 0) {
  Mask mask{grid, std::vector<uint8_t>(grid.count())};
  for (int k = margin; k < grid.size.z - margin; ++k)
    for (int j = margin; j < grid.size.y - margin; ++j)
      for (int i = margin; i < grid.size.x - margin; ++i) mask.values[grid.offset(i, j, k)] = 1;
  return mask;
}

/// A textured body: structures of 5 mm around a mean of 500, amplitude about 150.
inline double tissue_at(uint32_t seed, glm::dvec3 lps_mm) {
  return 500.0 + 300.0 * texture::tissue(seed, lps_mm, 5.0, 11.0);
}

}  // namespace palpate::test
