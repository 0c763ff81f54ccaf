#pragma once

#include <cstddef>
#include <vector>

#include "compute/volume/field.h"

namespace palpate {

/// The inverse of a field: w with w(y) = -u(y + w(y)), so that y -> y + w(y) undoes x -> x + u(x).
struct Inverse {
  Field w;
  /// |w(y) + u(y + w(y))| per sample, mm: the error of the solution. Where u folds there may be
  /// no solution.
  std::vector<float> residual_mm;
  size_t unconverged = 0;  ///< samples whose residual is above the tolerance
};

/// Solves for w on the given grid: fixed-point steps w <- -u(y + w) that start from the previous
/// sample's solution. Where these do not at least halve the residual, Newton steps with the
/// Jacobian of the trilinear field, shortened until the residual falls. tolerance_mm: 0 means a
/// thousandth of the finest edge of `onto`. Where neither converges, w is the best value found; see
/// residual_mm. Any thread; uses all cores.
Inverse inverse_of(const Field& u, const Grid& onto, double tolerance_mm = 0.0);

}  // namespace palpate
