#include "compute/volume/grid.h"

#include <algorithm>
#include <cmath>

namespace palpate {

bool same_geometry(const Grid& a, const Grid& b) {
  if (a.size != b.size) return false;
  // Corner by corner: one test compares spacing, origin and direction, in voxels.
  const double tolerance_mm = 1e-3 * a.finest_mm();
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 index =
        glm::dvec3(a.size - 1) * glm::dvec3(corner & 1, (corner >> 1) & 1, corner >> 2);
    if (glm::length(a.lps_from_index(index) - b.lps_from_index(index)) > tolerance_mm) return false;
  }
  return true;
}

bool has_centre_inside(const Grid& a, const Grid& b) {
  // Along a row of a, the index in b is a straight line: its part inside b's box is found axis by
  // axis.
  const glm::dvec3 step =
      b.index_from_lps(a.lps_from_index({1, 0, 0})) - b.index_from_lps(a.lps_from_index({0, 0, 0}));
  for (int k = 0; k < a.size.z; ++k) {
    for (int j = 0; j < a.size.y; ++j) {
      const glm::dvec3 start = b.index_from_lps(a.lps_from_index(glm::dvec3(0, j, k)));
      double low = 0.0, high = a.size.x - 1.0;
      for (int axis = 0; axis < 3; ++axis) {
        const double first = -0.5 - start[axis], last = b.size[axis] - 0.5 - start[axis];
        if (step[axis] == 0.0) {
          if (first > 0.0 || last < 0.0) high = -1.0;
          continue;
        }
        const double one = first / step[axis], other = last / step[axis];
        low = std::max(low, std::min(one, other));
        high = std::min(high, std::max(one, other));
      }
      if (std::ceil(low) <= std::floor(high)) return true;
    }
  }
  return false;
}

double gap_mm(const Grid& a, const Grid& b) {
  const auto nearest = [](const Grid& grid, glm::dvec3 lps_mm) {
    return grid.lps_from_index(
        glm::clamp(grid.index_from_lps(lps_mm), glm::dvec3(-0.5), glm::dvec3(grid.size) - 0.5));
  };
  // Projecting alternately onto two convex sets converges to their nearest points. Boxes face each
  // other with faces, edges or corners: a few rounds are exact to far below a voxel.
  constexpr int kRounds = 1000;
  glm::dvec3 in_a = a.lps_from_index(0.5 * glm::dvec3(a.size - 1)), in_b = nearest(b, in_a);
  for (int round = 0; round < kRounds; ++round) {
    in_a = nearest(a, in_b);
    in_b = nearest(b, in_a);
  }
  return glm::length(in_a - in_b);
}

Grid coarsened(const Grid& fine, glm::ivec3 cell) {
  Grid coarse = fine;
  coarse.size = (fine.size + cell - 1) / cell;
  coarse.spacing_mm = fine.spacing_mm * glm::dvec3(cell);
  coarse.origin_mm = fine.lps_from_index(0.5 * glm::dvec3(cell - 1));
  return coarse;
}

}  // namespace palpate
