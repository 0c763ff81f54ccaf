#pragma once

#include <cstdint>
#include <vector>

#include "tests/lab/stability/spring_wall.h"

namespace palpate::stability {

struct StabilityOutcome {
  StabilityCase at;
  StabilityResult result;
};

/// Runs the cases `seed` to `seed + runs - 1` of the grid at c times the stiffness b / (T/2 +
/// delay), on this many threads. lead_share: 0 is the plain loop. In the order of the seeds.
std::vector<StabilityOutcome> run_stability_grid(int runs, uint32_t seed, double c,
                                                 double lead_share, unsigned threads);

}  // namespace palpate::stability
