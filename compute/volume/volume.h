#pragma once

#include <cstdint>
#include <vector>

#include "compute/volume/grid.h"

namespace palpate {

/// One scalar frame. Values carry the unit of the file after rescale slope and intercept (HU for
/// CT). Shape (nz, ny, nx).
struct Volume {
  Grid grid;
  std::vector<float> values;

  float at(int i, int j, int k) const { return values[grid.offset(i, j, k)]; }
};

/// Which voxels count: non-zero is inside. Shape (nz, ny, nx).
struct Mask {
  Grid grid;
  std::vector<uint8_t> values;
};

/// The value at a continuous index, trilinear, the border value clamped outside. Any thread; does
/// not allocate.
double sample(const Volume& volume, glm::dvec3 index);

/// The volume on another grid, trilinear in physical space, border values clamped outside.
Volume resampled(const Volume& volume, const Grid& onto);

/// The mask at the sample centres of another grid, nearest neighbour; outside of it nothing counts.
Mask resampled(const Mask& mask, const Grid& onto);

}  // namespace palpate
