#pragma once

#include <vector>

#include "compute/volume/grid.h"

namespace palpate {

/// A dense motion field: the material at fixed point x (LPS mm) is at x + u(x) in the moving frame.
/// u is in mm along the physical LPS axes, as in an ITK displacement field; shape (nz, ny, nx), one
/// vector per sample. The grid is usually coarser than the image (see coarsened()); between samples
/// the field is trilinear, and beyond the outermost sample centres it is clamped to the border
/// value.
struct Field {
  Grid grid;
  std::vector<glm::vec3> u_mm;

  glm::vec3 at(int i, int j, int k) const { return u_mm[grid.offset(i, j, k)]; }
};

/// The standard deviation of a field's error, mm, per sample. x: along the local image gradient,
/// where the images show motion best. y: across it, in each of the two other directions, where they
/// show it least. 1.96 times as much is what the error's component stays below at 95 % of the
/// samples; the tails are longer than a Gaussian's.
struct Deviation {
  Grid grid;
  std::vector<glm::vec2> mm;  ///< empty: not known
};

/// How far a field may be trusted. values: in [0, 1] per sample, the share of such samples that are
/// right within half a voxel of the finest axis; 0: not at all.
struct Confidence {
  Grid grid;
  std::vector<float> values;
  Deviation deviation = {};  ///< on a grid of its own, which may be coarser
};

/// u at a continuous index of the field's own grid, trilinear, border clamped. Any thread; does not
/// allocate.
glm::dvec3 sample(const Field& field, glm::dvec3 index);

/// u at a physical point (LPS mm).
glm::dvec3 sample_at_lps(const Field& field, glm::dvec3 lps_mm);

/// The same field sampled on another grid (for files: the image's).
Field resampled(const Field& field, const Grid& onto);

/// The same confidence on another grid, trilinear, border values clamped outside.
/// The values only.
Confidence resampled(const Confidence& confidence, const Grid& onto);
Deviation resampled(const Deviation& deviation, const Grid& onto);

/// A field of zeros.
Field still_field(const Grid& grid);

}  // namespace palpate
