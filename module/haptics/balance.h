#pragma once

#include "module/haptics/primitive.h"

namespace palpate {

/// Where the proxy comes to rest, and how well that is known.
struct Balance {
  glm::dvec3 proxy{0.0};    ///< m
  double residual_n = 0.0;  ///< size of the KKT residual: what is left of the forces after the best
                            ///< admissible forces of the active primitives
  int iterations = 0;       ///< of the general solver; 0 where a closed form was used
  bool converged = true;    ///< residual_n <= 1e-9 N, or the bound of iterations was reached: then
                            ///< proxy is the best seen
};

/// The proxy that balances spring and primitives, equation (11): the one minimum of the strictly
/// convex
///   Phi(x) = k/2 |x - probe|^2 + sum_planes s max(0, -(x-x_j).q) + sum_lines s dist(x, line) +
///   sum_points s |x-x_j| - sum_forces s q.x.
/// Closed forms for any number of forces together with: nothing, one plane (with or without
/// friction), one line, one point, a plane and a line along the same direction through the same
/// point; a convex solver with a bound on iterations for the rest. Friction strengths come from a
/// first solve without friction, as the paper's (12) takes them. Space: any, all in m; stiffness in
/// N/m, > 0. Never NaN for finite input. Real-time safe: no allocation, noexcept.
Balance balance(const PrimitiveSet& primitives, glm::dvec3 probe,
                double stiffness_n_per_m) noexcept;

}  // namespace palpate
