#pragma once

#include <algorithm>
#include <cmath>

#include "module/haptics/primitive.h"

namespace palpate::test {

/// The round-off of a place: 16 units in the last place of its own coordinates, the primitive's and
/// the probe's, because all three are rounded and subtracted a few times. Coordinates count as a
/// millimetre at least, as in a workspace.
inline constexpr double kPlaceSlack = 0x1p-48;
inline constexpr double kSmallestPlace = 1e-3;

/// The largest |component|.
inline double largest_of(glm::dvec3 v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

/// The KKT residual at a proxy, computed without the solver, in N: the shortest sum of the spring
/// and of forces that the primitives can give at this place. A place has round-off, and the force
/// of a primitive jumps at the primitive. So each primitive may give the force of any place within
/// 16 units in the last place of the coordinates. A plane that of both sides, a line or point any
/// force if it is that near, else a force turned by the angle of this round-off as seen from the
/// proxy. The result is an upper bound that falls towards the true value with more iterations; they
/// end below enough_n. Planes with friction are taken without friction.
double residual_n(const PrimitiveSet& primitives, glm::dvec3 probe, double stiffness_n_per_m,
                  glm::dvec3 proxy, double enough_n = 0.5e-9);

/// Phi of balance.h at x, in J, in extended precision.
long double objective_j(const PrimitiveSet& primitives, glm::dvec3 probe, double stiffness_n_per_m,
                        glm::dvec3 x);

/// The proxy by splitting: each primitive in turn moves the proxy to where it alone would move it
/// from its present place (block coordinate ascent of the dual; extended precision). Slow, but
/// always converges.
glm::dvec3 slow_balance(const PrimitiveSet& primitives, glm::dvec3 probe, double stiffness_n_per_m,
                        int sweeps);

}  // namespace palpate::test
