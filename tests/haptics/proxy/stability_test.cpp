// A seeded part of the grid that `palpate-lab feel stability` runs as a whole. The oracle is the
// physics alone: the motion of the mass after the time in which the loop without rounding would
// come to rest.
#include <gtest/gtest.h>

#include "module/haptics/proxy/delay_lead.h"
#include "tests/lab/stability/spring_wall.h"

namespace palpate::stability {
namespace {

int limit_cycles(int runs, double c, double share, uint32_t first_seed = 0) {
  int found = 0;
  for (int n = 0; n < runs; ++n)
    found += run_stability(stability_case(first_seed + uint32_t(n), c), share).limit_cycle;
  return found;
}

TEST(Stability, HasNoLimitCycleWithTheLeadUpToTheLimit) {
  for (const double c : {0.7, 0.9, 0.98}) {
    for (uint32_t seed = 0; seed < 300; ++seed) {
      const StabilityResult r = run_stability(stability_case(seed, c), DelayLead::kShare);
      EXPECT_FALSE(r.limit_cycle) << "seed " << seed << ", c " << c << ": " << r.swing_m * 1e6
                                  << " um";
    }
  }
}

TEST(Stability, FindsTheLimitCyclesThatThePlainLoopHas) {
  // 36 % of a larger sample. This shows that the criterion does find limit cycles.
  EXPECT_GT(limit_cycles(60, 0.98, 0.0), 10);
}

TEST(Stability, FindsThatThePlainLoopIsStableWellBelowTheLimit) {
  EXPECT_EQ(limit_cycles(300, 0.5, 0.0), 0);
}

TEST(Stability, AgreesWithTheFormulaWhereNothingIsRounded) {
  // Without a hand, with an exact encoder: the limit is b / (T/2 + delay) within 6 %.
  for (const double damping : {0.5, 2.0, 5.0}) {
    for (const double delay_s : {0.0, 1e-3, 2.4e-3}) {
      StabilityCase at;
      at.body = {.mass_kg = 0.1, .damping_n_s_per_m = damping};
      at.delay_s = delay_s;
      const double limit = stable_stiffness(damping, 1e-3, delay_s);
      at.stiffness_n_per_m = 0.94 * limit;
      EXPECT_FALSE(run_stability(at, 0.0).limit_cycle) << damping << " " << delay_s;
      // With more damping the loop is stable somewhat beyond the formula, which is only a
      // sufficient condition.
      at.stiffness_n_per_m = (damping < 1.0 ? 1.06 : 1.25) * limit;
      EXPECT_TRUE(run_stability(at, 0.0).limit_cycle) << damping << " " << delay_s;
    }
  }
}

TEST(Stability, DoesNotHitHarderWithTheLead) {
  // The lead removes a part of what sampling and delay add to an impact. Without rounding, so that
  // both runs have the same encoder counts; without firm and springy hands, whose press is larger
  // than the impact.
  int seen = 0;
  for (uint32_t seed = 0; seed < 200; ++seed) {
    StabilityCase at = stability_case(seed, 0.7);
    if (at.hand > 2) continue;
    at.resolution_m = 0.0;
    const double plain = run_stability(at, 0.0).largest_n;
    const double led = run_stability(at, DelayLead::kShare).largest_n;
    EXPECT_LE(led, plain) << "seed " << seed;
    // And the wall stays as stiff.
    EXPECT_GT(led, 0.8 * plain) << "seed " << seed;
    ++seen;
  }
  EXPECT_GT(seen, 80);
}

}  // namespace
}  // namespace palpate::stability
