#pragma once

#include "module/haptics/primitive.h"

namespace palpate {

/// Where the proxy comes to rest, and how well that is known.
struct Balance {
  glm::dvec3 proxy{0.0};  ///< m
  /// What is left of spring and forces: a bound on the size of the KKT residual. Places are known
  /// to round-off only, and forces jump at primitives. So each primitive may give what it gives
  /// anywhere within 16 units in the last place of the largest coordinate (at least 1 mm), as it
  /// would if its position were rounded differently. 0 where a closed form was used.
  double residual_n = 0.0;
  int iterations = 0;  ///< of the general solver; 0 where a closed form was used
  /// residual_n <= 1e-9 N; if not, a bound of iterations was reached or the numbers are too large
  /// for doubles: then proxy is the probe or near the balance
  bool converged = true;
};

/// Which primitives were active in one balance and with what force: the next solve starts from it
/// if its primitives are similar. Only an initial guess: the result is the same but for round-off
/// and for how forces are shared where they are not unique. Plain data, no thread of its own.
struct BalanceHint {
  struct Stage {
    int planes = -1, lines = -1;  ///< how many of each; -1: nothing known
    std::array<double, PrimitiveSet::kCapacity> plane_n;
    std::array<bool, PrimitiveSet::kCapacity> plane_active;
    std::array<glm::dvec3, 2 * PrimitiveSet::kCapacity> line_n;
    std::array<bool, 2 * PrimitiveSet::kCapacity> line_active;
  };
  Stage without_friction, with_friction;
};

/// The proxy that balances spring and primitives, equation (11): the one minimum of the strictly
/// convex
///   Phi(x) = k/2 |x - probe|^2 + sum_planes s max(0, -(x-x_j).q) + sum_lines s dist(x, line) +
///   sum_points s |x-x_j| - sum_forces s q.x.
/// Closed forms for any number of forces together with: nothing; planes along one direction, both
/// ways, with or without friction, and lines along it, all through one point; points at one place.
/// A convex solver with a bound on iterations for the rest (balance_convex.h). Friction strengths
/// come from a first solve without friction, as the paper's (12) takes them; planes that repeat
/// share the normal force in proportion to strength. Space: any, all in m; stiffness in N/m, > 0.
/// Never NaN for finite input. Real-time safe: no allocation, noexcept. A hint is read and renewed.
Balance balance(const PrimitiveSet& primitives, glm::dvec3 probe, double stiffness_n_per_m,
                BalanceHint* hint = nullptr) noexcept;

}  // namespace palpate
