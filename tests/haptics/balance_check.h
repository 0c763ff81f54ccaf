#pragma once

#include <algorithm>
#include <cmath>

#include "module/haptics/primitive.h"

namespace palpate::test {

/// A place is known to 16 units in the last place: of its own coordinates, the primitive's and the
/// probe's, as all three are rounded and subtracted, a few times each. In a workspace, so those of
/// a millimetre at least.
inline constexpr double kPlaceSlack = 0x1p-48;
inline constexpr double kSmallestPlace = 1e-3;

/// The largest |component|.
inline double largest_of(glm::dvec3 v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

/// The KKT residual at a proxy, worked out without the solver, in N: the shortest sum of spring and
/// forces that the primitives can give at this place. A place is known to round-off only, and what
/// a primitive can give jumps at it; so each may give what it gives anywhere within 16 units in
/// the last place of the coordinates: a plane on both sides of zero, a line or point any force when
/// it is that near, and a force turned by the angle that it is seen under when it is further off.
/// The result is an upper bound that comes down to the true value with the work done; the work ends
/// below enough_n. Planes with friction count without it.
double residual_n(const PrimitiveSet& primitives, glm::dvec3 probe, double stiffness_n_per_m,
                  glm::dvec3 proxy, double enough_n = 0.5e-9);

/// Phi of balance.h at x, in J, in extended precision.
long double objective_j(const PrimitiveSet& primitives, glm::dvec3 probe, double stiffness_n_per_m,
                        glm::dvec3 x);

/// The proxy by splitting: each primitive in turn moves the proxy to where it alone would, as seen
/// from where the others have brought it (block coordinate ascent of the dual; extended precision).
/// Comes near slowly, and never fails.
glm::dvec3 slow_balance(const PrimitiveSet& primitives, glm::dvec3 probe, double stiffness_n_per_m,
                        int sweeps);

}  // namespace palpate::test
