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

/// A value in [0, 1] per sample of a field: how far the field may be trusted there. 0: not at all.
struct Confidence {
  Grid grid;
  std::vector<float> values;
};

/// u at a continuous index of the field's own grid, trilinear, border clamped. Any thread; does not
/// allocate.
glm::dvec3 sample(const Field& field, glm::dvec3 index);

/// u at a physical point (LPS mm).
glm::dvec3 sample_at_lps(const Field& field, glm::dvec3 lps_mm);

/// The same field sampled on another grid (for files: the image's).
Field resampled(const Field& field, const Grid& onto);

/// The same confidence on another grid, trilinear, border values clamped outside.
Confidence resampled(const Confidence& confidence, const Grid& onto);

/// A field of zeros.
Field still_field(const Grid& grid);

}  // namespace palpate
