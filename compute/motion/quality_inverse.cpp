#include "compute/motion/quality_inverse.h"

#include <atomic>
#include <cmath>

#include "compute/volume/parallel.h"

namespace palpate {
namespace {

constexpr int kFixedPointSteps = 30;
constexpr int kNewtonSteps = 30;
constexpr double kShortestStep = 1.0 / 64.0;

struct Solution {
  glm::dvec3 w_mm;
  double residual_mm;
};

/// Solves w + u(y + w) = 0 for one y.
class PointSolver {
 public:
  PointSolver(const Field& u, double tolerance_mm)
      : u_(u),
        tolerance_mm_(tolerance_mm),
        from_index_(u.grid.direction * glm::dmat3(u.grid.spacing_mm.x, 0, 0, 0, u.grid.spacing_mm.y,
                                                  0, 0, 0, u.grid.spacing_mm.z)),
        to_index_(glm::inverse(from_index_)) {}

  Solution solve(glm::dvec3 y_mm, glm::dvec3 start_mm) const {
    Solution best = residual_at(y_mm, start_mm);
    for (int step = 0; step < kFixedPointSteps && best.residual_mm > tolerance_mm_; ++step) {
      const glm::dvec3 next_mm = -sample(u_, to_index_ * (y_mm + best.w_mm - u_.grid.origin_mm));
      const Solution next = residual_at(y_mm, next_mm);
      const bool halved = next.residual_mm <= 0.5 * best.residual_mm;
      if (next.residual_mm < best.residual_mm) best = next;
      if (!halved) break;
    }
    for (int step = 0; step < kNewtonSteps && best.residual_mm > tolerance_mm_; ++step) {
      if (!newton_step(y_mm, best)) break;
    }
    return best;
  }

 private:
  glm::dvec3 equation(glm::dvec3 y_mm, glm::dvec3 w_mm) const {
    return w_mm + sample(u_, to_index_ * (y_mm + w_mm - u_.grid.origin_mm));
  }

  Solution residual_at(glm::dvec3 y_mm, glm::dvec3 w_mm) const {
    return {w_mm, glm::length(equation(y_mm, w_mm))};
  }

  /// I + grad u inside the cell around an index: the difference across the cell along an axis is
  /// the exact derivative of the trilinear field. Zero along an axis on which the index is clamped
  /// to the edge.
  glm::dmat3 jacobian(glm::dvec3 index) const {
    glm::dmat3 per_index(0.0);
    for (int axis = 0; axis < 3; ++axis) {
      const double last = double(u_.grid.size[axis] - 1);
      if (index[axis] < 0.0 || index[axis] >= last) continue;
      glm::dvec3 low = index;
      glm::dvec3 high = index;
      low[axis] = std::floor(index[axis]);
      high[axis] = low[axis] + 1.0;
      per_index[axis] = sample(u_, high) - sample(u_, low);
    }
    return glm::dmat3(1.0) + per_index * to_index_;
  }

  bool newton_step(glm::dvec3 y_mm, Solution& best) const {
    const glm::dvec3 index = to_index_ * (y_mm + best.w_mm - u_.grid.origin_mm);
    const glm::dmat3 slope = jacobian(index);
    if (!(std::abs(glm::determinant(slope)) > 1e-9)) return false;
    const glm::dvec3 step = glm::inverse(slope) * equation(y_mm, best.w_mm);
    for (double part = 1.0; part >= kShortestStep; part *= 0.5) {
      const Solution next = residual_at(y_mm, best.w_mm - part * step);
      if (next.residual_mm < best.residual_mm) {
        best = next;
        return true;
      }
    }
    return false;
  }

  const Field& u_;
  double tolerance_mm_;
  glm::dmat3 from_index_, to_index_;
};

}  // namespace

Inverse inverse_of(const Field& u, const Grid& onto, double tolerance_mm) {
  const double tolerance = tolerance_mm > 0.0 ? tolerance_mm : 1e-3 * onto.finest_mm();
  const PointSolver solver(u, tolerance);
  Inverse result{still_field(onto), std::vector<float>(onto.count()), 0};
  std::atomic<size_t> unconverged{0};
  parallel_ranges(onto.size.z, 500.0 * onto.size.x * onto.size.y, [&](int begin, int end) {
    size_t missed = 0;
    for (int k = begin; k < end; ++k) {
      for (int j = 0; j < onto.size.y; ++j) {
        glm::dvec3 start_mm(0.0);
        for (int i = 0; i < onto.size.x; ++i) {
          const Solution found = solver.solve(onto.lps_from_index({i, j, k}), start_mm);
          const bool converged = found.residual_mm <= tolerance;
          start_mm = converged ? found.w_mm : glm::dvec3(0.0);
          missed += !converged;
          result.w.u_mm[onto.offset(i, j, k)] = glm::vec3(found.w_mm);
          result.residual_mm[onto.offset(i, j, k)] = float(found.residual_mm);
        }
      }
    }
    unconverged += missed;
  });
  result.unconverged = unconverged;
  return result;
}

}  // namespace palpate
