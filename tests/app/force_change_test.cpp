// How fast a force changes, from ticks at uneven times. Oracle: the slope of the force that was
// sampled, in closed form.
#include "integration/running/force_change.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace palpate::running {
namespace {

constexpr double kSteepest_n_per_ms = 0.1;

/// A force whose slope is at most kSteepest_n_per_ms.
glm::dvec3 swinging_n(double time_s) {
  return {1e3 * kSteepest_n_per_ms / 40.0 * std::sin(40.0 * time_s), 0.0, 0.0};
}

TEST(ForceChange, GivesTheSlopeOfEvenTicks) {
  for (const double period_s : {0.25e-3, 1e-3}) {
    ForceChange change(period_s);
    for (int k = 0; k < 2000; ++k) change.add(period_s, swinging_n(period_s * k));
    EXPECT_NEAR(change.largest_n_per_ms(), kSteepest_n_per_ms, 1e-4);
    EXPECT_EQ(change.late_ticks(), 0U);
  }
  // At 500 Hz half of what changes between two ticks.
  ForceChange slow(2e-3);
  for (int k = 0; k < 2000; ++k) slow.add(2e-3, swinging_n(2e-3 * k));
  EXPECT_NEAR(slow.largest_n_per_ms(), kSteepest_n_per_ms, 1e-4);
  EXPECT_EQ(slow.late_ticks(), 0U);
}

TEST(ForceChange, IsNoLargerWhereTheLoopCatchesUp) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> jitter(0.2e-3, 1.4e-3), late(1.6e-3, 6e-3);
    ForceChange change;
    double time_s = 0.0, latest_s = 0.0;
    uint64_t count = 0;
    const auto tick = [&](double dt_s) { change.add(dt_s, swinging_n(time_s += dt_s)); };
    for (int k = 0; k < 20'000; ++k) {
      tick(jitter(random));
      if (k % 50 != 49) continue;
      const double by_s = late(random);
      tick(by_s);
      ++count;
      latest_s = std::max(latest_s, by_s);
      // Those that were missed come at once.
      for (double left_s = by_s; left_s > 1e-3; left_s -= 1e-3) tick(1e-6);
    }
    EXPECT_LE(change.largest_n_per_ms(), kSteepest_n_per_ms + 1e-9) << seed;
    EXPECT_GT(change.largest_n_per_ms(), 0.95 * kSteepest_n_per_ms) << seed;
    EXPECT_EQ(change.late_ticks(), count) << seed;
    EXPECT_EQ(change.latest_s(), latest_s) << seed;
    EXPECT_LE(change.largest_late_n(), 1e3 * latest_s * kSteepest_n_per_ms) << seed;
    EXPECT_GT(change.largest_late_n(), 2.0 * kSteepest_n_per_ms) << seed;
  }
}

TEST(ForceChange, FindsAJumpAtAnyJitter) {
  for (const double dt_s : {1e-6, 0.3e-3, 0.999e-3, 1e-3, 1.001e-3}) {
    ForceChange change;
    for (int k = 0; k < 20; ++k) change.add(dt_s, {1.0, 0.0, 0.0});
    change.add(dt_s, {1.0, 0.5, 0.0});
    for (int k = 0; k < 20; ++k) change.add(dt_s, {1.0, 0.5, 0.0});
    // The first force of all is no change.
    EXPECT_NEAR(change.largest_n_per_ms(), 0.5, 1e-3) << dt_s;
  }
  // A jump in parts within a millisecond is one.
  ForceChange change;
  change.add(1e-3, glm::dvec3(0.0));
  for (int k = 1; k <= 5; ++k) change.add(0.1e-3, {0.1 * k, 0.0, 0.0});
  EXPECT_NEAR(change.largest_n_per_ms(), 0.5, 1e-12);
}

}  // namespace
}  // namespace palpate::running
