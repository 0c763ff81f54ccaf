#pragma once

#include <optional>
#include <span>
#include <vector>

namespace palpate {

/// A least-squares fit of n unknowns: min sum of weight (row x - value)^2 by its normal equations.
class LeastSquares {
 public:
  explicit LeastSquares(size_t unknowns);

  /// One equation. row: a factor for each unknown.
  void add(std::span<const double> row, double value, double weight = 1.0);

  /// Empty if the matrix is not positive definite up to rounding: the data do not determine all
  /// unknowns.
  std::optional<std::vector<double>> solve() const;

 private:
  size_t unknowns_;
  std::vector<double> matrix_;  ///< symmetric, its lower half filled in
  std::vector<double> right_;
};

}  // namespace palpate
