#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/glm.hpp>
#include <limits>

namespace palpate {

/// Where the samples of a volume or a field lie in space.
///
/// Index space is (i, j, k), x fastest in memory: sample (i, j, k) is values[i + nx * (j + ny *
/// k)], shape (nz, ny, nx). Physical space is the patient's, LPS, in mm, as ITK has it: x = origin
/// + direction * (spacing * index). Integer indices are sample CENTRES; a volume covers index -0.5
/// to n - 0.5.
struct Grid {
  glm::ivec3 size{0};          ///< samples along i, j, k
  glm::dvec3 spacing_mm{1.0};  ///< distance between neighbours along i, j, k; > 0
  glm::dvec3 origin_mm{0.0};   ///< LPS position of the centre of sample (0, 0, 0)
  glm::dmat3 direction{1.0};   ///< columns are the unit vectors of i, j, k in LPS; determinant +1
  /// The file of this image has left-handed axes, and its j axis was reversed when it was read. Not
  /// part of the geometry: readers set it, writers give images on this grid the axes of that file,
  /// nothing else uses it.
  bool j_reversed_in_file = false;

  size_t count() const { return size_t(size.x) * size_t(size.y) * size_t(size.z); }
  size_t offset(int i, int j, int k) const {
    return size_t(i) + size_t(size.x) * (size_t(j) + size_t(size.y) * size_t(k));
  }
  glm::dvec3 lps_from_index(glm::dvec3 index) const {
    return origin_mm + direction * (spacing_mm * index);
  }
  /// The direction is a rotation, so its transpose is its inverse.
  glm::dvec3 index_from_lps(glm::dvec3 lps_mm) const {
    return (glm::transpose(direction) * (lps_mm - origin_mm)) / spacing_mm;
  }
  /// Edge of the finest axis, the unit in which "voxel" is meant for anisotropic grids. The
  /// thickness of a single slice does not count, unless there is no other axis.
  double finest_mm() const {
    double finest = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis)
      if (size[axis] > 1) finest = std::min(finest, spacing_mm[axis]);
    return std::isfinite(finest) ? finest : std::min({spacing_mm.x, spacing_mm.y, spacing_mm.z});
  }
};

/// True if both grids have the same samples at the same places, to a thousandth of a voxel.
bool same_geometry(const Grid& a, const Grid& b);

/// True if the centre of at least one sample of `a` lies in the volume that `b` covers.
bool has_centre_inside(const Grid& a, const Grid& b);

/// The shortest distance between the volumes that the two grids cover, mm; 0 where they meet.
double gap_mm(const Grid& a, const Grid& b);

/// The grid of cells of `cell` samples along each axis, cell centres as samples: the last cell of
/// an axis may reach beyond the image. This is how a motion field coarser than its image is laid
/// out.
Grid coarsened(const Grid& fine, glm::ivec3 cell);

}  // namespace palpate
