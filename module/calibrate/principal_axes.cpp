#include "module/calibrate/principal_axes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>

namespace palpate {

SymmetricEigen symmetric_eigen(std::span<const double> matrix, size_t n) {
  assert(matrix.size() == n * n);
  const auto size = Eigen::Index(n);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(
      Eigen::Map<const Eigen::MatrixXd>(matrix.data(), size, size));
  SymmetricEigen found;
  for (Eigen::Index k = 0; k < size; ++k) {
    found.values.push_back(solver.eigenvalues()[k]);
    const auto vector = solver.eigenvectors().col(k);
    found.vectors.emplace_back(vector.begin(), vector.end());
  }
  return found;
}

PrincipalAxes principal_axes(std::span<const glm::dvec3> points) {
  PrincipalAxes found;
  for (const glm::dvec3& point : points) found.centre += point / double(points.size());
  glm::dmat3 covariance(0.0);
  for (const glm::dvec3& point : points) {
    const glm::dvec3 off = point - found.centre;
    covariance += glm::outerProduct(off, off) / double(points.size());
  }
  const SymmetricEigen eigen = symmetric_eigen({&covariance[0][0], 9}, 3);
  for (int k = 0; k < 3; ++k) {
    found.variance[k] = std::max(0.0, eigen.values[size_t(k)]);
    for (int i = 0; i < 3; ++i) found.axes[k][i] = eigen.vectors[size_t(k)][size_t(i)];
  }
  return found;
}

}  // namespace palpate
