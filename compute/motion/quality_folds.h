#pragma once

#include <cstddef>

#include "compute/volume/field.h"
#include "compute/volume/volume.h"

namespace palpate {

/// Jacobian determinants of x -> x + u(x).
struct Folds {
  size_t voxels = 0;        ///< samples examined
  size_t folded = 0;        ///< samples with det <= 0 (or NaN) at any of their 8 corners
  double min_det = 1.0;     ///< smallest det of all corners; 1 without samples, -inf with NaN
  double sd_log_det = 0.0;  ///< SD of log det, central differences, over samples where that is > 0
  size_t not_finite = 0;    ///< samples of u with a NaN or an infinity
};

/// Computes det(I + grad u) at the 8 corners of every sample of the field's own grid: per axis the
/// difference to the next or to the previous neighbour, in mm, in all combinations. (Central
/// differences would miss a fold between two samples.) With edges E_a = e_a + (u(i_a + 1) - u(i_a))
/// / h_a and e_a the unit vector of index axis a,
///   det(I + grad u) = det[E_x E_y E_z],
/// since the direction matrix has determinant 1: spacing and direction are taken into account
/// without a rotation per sample. At the border the existing difference is used for both sides; an
/// axis of one sample contributes none. mask: null, or on the field's grid; only its samples count.
/// To judge a field as it will be written, resample it first. Any thread; uses all cores.
Folds folds(const Field& u, const Mask* mask = nullptr);

}  // namespace palpate
