#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace palpate {

/// Eigenvalues of a symmetric matrix, rising, and its unit eigenvectors.
struct SymmetricEigen {
  std::vector<double> values;
  std::vector<std::vector<double>> vectors;
};

/// matrix: n x n elements; the lower half is read.
SymmetricEigen symmetric_eigen(std::span<const double> matrix, size_t n);

/// Centre of a set of points, and their spread along each of their principal axes.
struct PrincipalAxes {
  glm::dvec3 centre{0.0};
  glm::dvec3 variance{0.0};  ///< mean square distance from the centre along each axis, rising
  glm::dmat3 axes{1.0};      ///< unit vectors, one per column
};

/// Needs at least one point.
PrincipalAxes principal_axes(std::span<const glm::dvec3> points);

}  // namespace palpate
