#include "module/calibrate/least_squares.h"

#include <Eigen/Cholesky>
#include <cassert>

namespace palpate {

LeastSquares::LeastSquares(size_t unknowns)
    : unknowns_(unknowns), matrix_(unknowns * unknowns), right_(unknowns) {}

void LeastSquares::add(std::span<const double> row, double value, double weight) {
  assert(row.size() == unknowns_);
  for (size_t i = 0; i < unknowns_; ++i) {
    for (size_t k = 0; k <= i; ++k) matrix_[k * unknowns_ + i] += weight * row[i] * row[k];
    right_[i] += weight * value * row[i];
  }
}

std::optional<std::vector<double>> LeastSquares::solve() const {
  const auto n = Eigen::Index(unknowns_);
  const Eigen::Map<const Eigen::MatrixXd> matrix(matrix_.data(), n, n);
  const Eigen::LLT<Eigen::MatrixXd> factors(matrix);
  if (factors.info() != Eigen::Success) return std::nullopt;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double pivot = factors.matrixLLT()(i, i);
    if (!(pivot * pivot > 1e-12 * matrix(i, i))) return std::nullopt;
  }
  std::vector<double> x = right_;
  Eigen::Map<Eigen::VectorXd> solution(x.data(), n);
  factors.solveInPlace(solution);
  return x;
}

}  // namespace palpate
