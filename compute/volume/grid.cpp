#include "compute/volume/grid.h"

namespace palpate {

bool same_geometry(const Grid& a, const Grid& b) {
  if (a.size != b.size) return false;
  // Corner by corner: one test sees spacing, origin and direction in the unit that matters, the voxel.
  const double tolerance_mm = 1e-3 * a.finest_mm();
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 index = glm::dvec3(a.size - 1) * glm::dvec3(corner & 1, (corner >> 1) & 1, corner >> 2);
    if (glm::length(a.lps_from_index(index) - b.lps_from_index(index)) > tolerance_mm) return false;
  }
  return true;
}

Grid coarsened(const Grid& fine, glm::ivec3 cell) {
  Grid coarse = fine;
  coarse.size = (fine.size + cell - 1) / cell;
  coarse.spacing_mm = fine.spacing_mm * glm::dvec3(cell);
  coarse.origin_mm = fine.lps_from_index(0.5 * glm::dvec3(cell - 1));
  return coarse;
}

}  // namespace palpate
