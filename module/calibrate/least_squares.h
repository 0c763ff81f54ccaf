#pragma once

#include <Eigen/Cholesky>
#include <optional>

namespace palpate {

/// A least-squares fit of n unknowns: min sum of weight (row x - value)^2 by its normal equations.
template <int n>
class LeastSquares {
 public:
  using Vector = Eigen::Matrix<double, n, 1>;

  void add(const Vector& row, double value, double weight = 1.0) {
    matrix_.template selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
    right_ += weight * value * row;
  }

  /// Empty if the matrix is not positive definite up to rounding: the data do not determine all
  /// unknowns.
  std::optional<Vector> solve() const {
    const Eigen::LLT<Matrix> factors(matrix_);
    if (factors.info() != Eigen::Success) return std::nullopt;
    const Vector pivots = factors.matrixLLT().diagonal();
    for (int i = 0; i < n; ++i)
      if (!(pivots[i] * pivots[i] > 1e-12 * matrix_(i, i))) return std::nullopt;
    return factors.solve(right_);
  }

 private:
  using Matrix = Eigen::Matrix<double, n, n>;
  Matrix matrix_ = Matrix::Zero();  // its lower half
  Vector right_ = Vector::Zero();
};

}  // namespace palpate
