#pragma once

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <span>

#include <glm/glm.hpp>

namespace palpate {

/// Where points lie, and how far they spread along each of their principal axes.
struct PrincipalAxes {
  glm::dvec3 centre{0.0};
  glm::dvec3 variance{0.0};  ///< mean square distance from the centre along each axis, rising
  glm::dmat3 axes{1.0};      ///< unit vectors, one per column
};

/// Of one point at least.
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
