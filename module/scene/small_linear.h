#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

/// Small dense symmetric systems, for fits of a handful of unknowns. Double; nothing is allocated.
namespace palpate::linear {

template <size_t n>
using Vector = std::array<double, n>;
template <size_t n>
using Matrix = std::array<std::array<double, n>, n>;

/// Eigenvalues, rising, and unit eigenvectors: vectors[i] belongs to values[i].
template <size_t n>
struct Eigen {
  Vector<n> values{};
  Matrix<n> vectors{};
};

/// Of a symmetric matrix by Jacobi's rotations, swept until what is off the diagonal is rounding.
template <size_t n>
Eigen<n> eigen(Matrix<n> a) {
  Matrix<n> v{};
  for (size_t i = 0; i < n; ++i) v[i][i] = 1.0;
  for (int sweep = 0; sweep < 60; ++sweep) {
    double off = 0.0, on = 0.0;
    for (size_t i = 0; i < n; ++i)
      for (size_t j = 0; j < n; ++j) (i == j ? on : off) += a[i][j] * a[i][j];
    if (off <= 1e-30 * on) break;
    for (size_t p = 0; p < n; ++p)
      for (size_t q = p + 1; q < n; ++q) {
        if (a[p][q] == 0.0) continue;
        const double theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
        const double t = (theta < 0 ? -1.0 : 1.0) / (std::abs(theta) + std::hypot(theta, 1.0));
        const double c = 1.0 / std::hypot(t, 1.0), s = t * c;
        for (size_t k = 0; k < n; ++k) {
          const double kp = a[k][p], kq = a[k][q];
          a[k][p] = c * kp - s * kq;
          a[k][q] = s * kp + c * kq;
        }
        for (size_t k = 0; k < n; ++k) {
          const double pk = a[p][k], qk = a[q][k];
          a[p][k] = c * pk - s * qk;
          a[q][k] = s * pk + c * qk;
        }
        for (size_t k = 0; k < n; ++k) {
          const double kp = v[k][p], kq = v[k][q];
          v[k][p] = c * kp - s * kq;
          v[k][q] = s * kp + c * kq;
        }
      }
  }
  std::array<size_t, n> order;
  for (size_t i = 0; i < n; ++i) order[i] = i;
  for (size_t i = 1; i < n; ++i)
    for (size_t j = i; j > 0 && a[order[j]][order[j]] < a[order[j - 1]][order[j - 1]]; --j)
      std::swap(order[j], order[j - 1]);
  Eigen<n> found;
  for (size_t i = 0; i < n; ++i) {
    found.values[i] = a[order[i]][order[i]];
    for (size_t k = 0; k < n; ++k) found.vectors[i][k] = v[k][order[i]];
  }
  return found;
}

/// Normal equations of a least-squares fit, put together row by row.
template <size_t n>
struct Normal {
  Matrix<n> matrix{};
  Vector<n> right{};
  void add(const Vector<n>& row, double value, double weight = 1.0) {
    for (size_t i = 0; i < n; ++i) {
      right[i] += weight * row[i] * value;
      for (size_t j = 0; j <= i; ++j) matrix[i][j] += weight * row[i] * row[j];
    }
  }
};

/// The solution by Cholesky; none if the matrix is not positive definite to rounding: the data do
/// not tell all unknowns.
template <size_t n>
std::optional<Vector<n>> solve(const Normal<n>& normal) {
  Matrix<n> l{};
  for (size_t i = 0; i < n; ++i)
    for (size_t j = 0; j <= i; ++j) {
      double sum = normal.matrix[i][j];
      for (size_t k = 0; k < j; ++k) sum -= l[i][k] * l[j][k];
      if (i == j) {
        if (!(sum > 1e-12 * normal.matrix[i][i])) return std::nullopt;
        l[i][i] = std::sqrt(sum);
      } else {
        l[i][j] = sum / l[j][j];
      }
    }
  Vector<n> x{};
  for (size_t i = 0; i < n; ++i) {
    double sum = normal.right[i];
    for (size_t k = 0; k < i; ++k) sum -= l[i][k] * x[k];
    x[i] = sum / l[i][i];
  }
  for (size_t i = n; i-- > 0;) {
    double sum = x[i];
    for (size_t k = i + 1; k < n; ++k) sum -= l[k][i] * x[k];
    x[i] = sum / l[i][i];
  }
  return x;
}

}  // namespace palpate::linear
