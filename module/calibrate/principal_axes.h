#pragma once

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <span>

#include <glm/glm.hpp>

namespace palpate {

/// Centre of a set of points, and their spread along each of their principal axes.
struct PrincipalAxes {
  glm::dvec3 centre{0.0};
  glm::dvec3 variance{0.0};  ///< mean square distance from the centre along each axis, rising
  glm::dmat3 axes{1.0};      ///< unit vectors, one per column
};

/// Needs at least one point.
inline PrincipalAxes principal_axes(std::span<const glm::dvec3> points) {
  PrincipalAxes found;
  for (const glm::dvec3& point : points) found.centre += point / double(points.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const glm::dvec3& point : points) {
    const glm::dvec3 d = point - found.centre;
    const Eigen::Vector3d off(d.x, d.y, d.z);
    covariance += off * off.transpose() / double(points.size());
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  for (int k = 0; k < 3; ++k) {
    found.variance[k] = std::max(0.0, solver.eigenvalues()[k]);
    for (int i = 0; i < 3; ++i) found.axes[k][i] = solver.eigenvectors()(i, k);
  }
  return found;
}

}  // namespace palpate
