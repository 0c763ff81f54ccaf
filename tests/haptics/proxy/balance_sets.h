#pragma once

#include "module/haptics/primitive.h"

namespace palpate::test {

/// All arguments of balance().
struct BalanceCase {
  PrimitiveSet primitives;
  glm::dvec3 probe{0.0};
  double stiffness_n_per_m = 1000.0;
};

/// A set of 1 to 32 primitives of all kinds, without friction: strengths 1e-6 to 1e3 N, stiffness
/// 10 to 1e5 N/m, positions within 1 m. Degenerate cases are included: positions that coincide;
/// directions that are parallel, opposite, orthogonal or nearly parallel (1e-2 to 1e-14); probes on
/// a primitive. Equal seeds give equal sets.
BalanceCase random_set(unsigned seed);

}  // namespace palpate::test
