#pragma once

#include <cmath>
#include <numbers>
#include <string>

#include "compute/volume/field.h"
#include "compute/volume/phantom_texture.h"
#include "compute/volume/volume.h"
#include "tests/volume/grids.h"

/// Pairs of frames whose motion is given by a formula.
namespace palpate::test {

/// x -> centre + linear (x - centre) + shift, LPS mm.
struct AffineMap {
  glm::dmat3 linear{1.0};
  glm::dvec3 shift_mm{0.0};
  glm::dvec3 centre_mm{0.0};

  glm::dvec3 operator()(glm::dvec3 x) const {
    return centre_mm + linear * (x - centre_mm) + shift_mm;
  }
  glm::dvec3 inverse(glm::dvec3 y) const {
    return centre_mm + glm::inverse(linear) * (y - shift_mm - centre_mm);
  }
};

struct MadePair {
  Volume fixed, moving;
  Field truth;
};

/// LPS position of the middle of a grid.
inline glm::dvec3 middle_of(const Grid& grid) {
  return grid.lps_from_index(0.5 * glm::dvec3(grid.size - 1));
}

/// A textured body (structures of 6 and 13 voxels of the finest axis, intensities 200 to 800) and
/// the same body moved by the map: the value at x in fixed is the value at map(x) in moving.
/// voxel_mm: 0 for the finest axis.
inline MadePair made_pair(const Grid& grid, const AffineMap& map, uint32_t seed = 1,
                          double voxel_mm = 0.0) {
  if (voxel_mm <= 0.0) voxel_mm = grid.finest_mm();
  const auto body = [&](glm::dvec3 lps_mm) {
    return 500.0 + 300.0 * texture::tissue(seed, lps_mm, 6.0 * voxel_mm, 13.0 * voxel_mm);
  };
  MadePair pair;
  pair.fixed = pair.moving = Volume{grid, std::vector<float>(grid.count())};
  pair.truth = still_field(grid);
  for (int k = 0; k < grid.size.z; ++k) {
    for (int j = 0; j < grid.size.y; ++j) {
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 x = grid.lps_from_index({i, j, k});
        const size_t at = grid.offset(i, j, k);
        pair.fixed.values[at] = float(body(x));
        pair.moving.values[at] = float(body(map.inverse(x)));
        pair.truth.u_mm[at] = glm::vec3(map(x) - x);
      }
    }
  }
  return pair;
}

/// A body with structures of 4 and 9 mm and a sinusoidal motion along k with a wavelength of
/// `length` mm: u = gradient / w sin(w z), w = 2 pi / length. The value at x + u(x) in moving is
/// the value at x in fixed. For a plain grid.
inline MadePair wave_pair(const Grid& grid, double gradient, double length, uint32_t seed = 1) {
  const double w = 2.0 * std::numbers::pi / length;
  const auto body = [&](glm::dvec3 lps_mm) {
    return float(500.0 + 300.0 * texture::tissue(seed, lps_mm, 4.0, 9.0));
  };
  MadePair pair;
  pair.fixed = pair.moving = Volume{grid, std::vector<float>(grid.count())};
  pair.truth = still_field(grid);
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 x = grid.lps_from_index({i, j, k});
        const glm::dvec3 u(0.0, 0.0, gradient / w * std::sin(w * x.z));
        const size_t at = grid.offset(i, j, k);
        pair.truth.u_mm[at] = glm::vec3(u);
        pair.fixed.values[at] = body(x + u);
        pair.moving.values[at] = body(x);
      }
  return pair;
}

/// Voxels of fixed that are at least `margin` voxels inside the image and whose partner in moving
/// is too: both frames show this material.
inline Mask seen_in_both(const Field& truth, double margin) {
  const Grid& grid = truth.grid;
  const auto inside = [&](glm::dvec3 index) {
    return glm::all(glm::greaterThanEqual(index, glm::dvec3(margin))) &&
           glm::all(glm::lessThanEqual(index, glm::dvec3(grid.size - 1) - margin));
  };
  Mask mask{grid, std::vector<uint8_t>(grid.count())};
  for (int k = 0; k < grid.size.z; ++k) {
    for (int j = 0; j < grid.size.y; ++j) {
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 moved = grid.lps_from_index({i, j, k}) + glm::dvec3(truth.at(i, j, k));
        mask.values[grid.offset(i, j, k)] =
            inside({i, j, k}) && inside(grid.index_from_lps(moved)) ? 1 : 0;
      }
    }
  }
  return mask;
}

/// The same for a grid of one slice, across which nothing moves.
inline Mask seen_in_plane(const Field& truth, int across, double margin) {
  Mask mask{truth.grid, std::vector<uint8_t>(truth.grid.count())};
  const Grid& grid = truth.grid;
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 index(i, j, k);
        const glm::dvec3 there =
            grid.index_from_lps(grid.lps_from_index(index) + glm::dvec3(truth.at(i, j, k)));
        bool inside = true;
        for (int axis = 0; axis < 3; ++axis) {
          if (axis == across) continue;
          const double last = grid.size[axis] - 1 - margin;
          inside = inside && index[axis] >= margin && there[axis] >= margin &&
                   index[axis] <= last && there[axis] <= last;
        }
        mask.values[grid.offset(i, j, k)] = inside;
      }
  return mask;
}

/// A volume of independent random values.
inline Volume noise_volume(const Grid& grid, uint32_t seed) {
  Volume volume{grid, std::vector<float>(grid.count())};
  for (size_t i = 0; i < volume.values.size(); ++i)
    volume.values[i] = float(1000.0 * texture::uniform(texture::mixed(seed) + uint32_t(i)));
  return volume;
}

/// Boxes of `edge` voxels, alternately 0 and 1000; `phase` exchanges them.
inline Volume checkerboard(const Grid& grid, int edge, int phase) {
  Volume volume{grid, std::vector<float>(grid.count())};
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i)
        volume.values[grid.offset(i, j, k)] =
            (i / edge + j / edge + k / edge + phase) % 2 ? 1000.0F : 0.0F;
  return volume;
}

inline Grid plain_grid(glm::ivec3 size, glm::dvec3 spacing_mm = glm::dvec3(1.0)) {
  Grid grid;
  grid.size = size;
  grid.spacing_mm = spacing_mm;
  return grid;
}

}  // namespace palpate::test
