#include "tests/lab/stability/guarded_wall.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate::stability {
namespace {

StabilityCase bare_grip(double stiffness_n_per_m) {
  StabilityCase at;
  at.body = {.mass_kg = 0.15, .damping_n_s_per_m = 2.0, .hand = devices::kNoHand};
  at.stiffness_n_per_m = stiffness_n_per_m;
  at.resolution_m = 38e-6;
  return at;
}

TEST(GuardedWall, PushesAsItsStiffnessSaysOnceItIsFelt) {
  GuardedWall wall(bare_grip(500.0), true);
  double push = 0.0;
  for (int i = 0; i < 400; ++i) push = wall.push_n(0.002, 1e-3);
  // The felt edge is found to a fifth of a micrometre.
  EXPECT_NEAR(push, -500.0 * 0.002, 500.0 * 2e-7 + 1e-9);
  EXPECT_FALSE(wall.heard());
  for (int i = 0; i < 50; ++i) push = wall.push_n(-0.001, 1e-3);
  EXPECT_EQ(push, 0.0);
}

TEST(GuardedWall, AsksForNoMoreThanADeviceSaysItHolds) {
  // b / (T/2 + delay) = 2 / 0.5 ms.
  EXPECT_DOUBLE_EQ(GuardedWall(bare_grip(8000.0), true).stiffness_n_per_m(), 4000.0);
  EXPECT_DOUBLE_EQ(GuardedWall(bare_grip(8000.0), false).stiffness_n_per_m(), 8000.0);
  EXPECT_DOUBLE_EQ(GuardedWall(bare_grip(1000.0), true).stiffness_n_per_m(), 1000.0);
}

TEST(GuardedWall, LetsADroppedGripComeToRest) {
  // At the first contact the force rises slowly; returned in full, this kept a grip bouncing 8 mm
  // high.
  for (const double speed_m_per_s : {0.05, 0.2, 0.4}) {
    const StabilityCase at = bare_grip(4000.0);
    GuardedWall wall(at, true);
    devices::HeldMass body(at.body, {-0.002, 0.0, 0.0});
    body.put({-0.002, 0.0, 0.0}, {speed_m_per_s, 0.0, 0.0});
    double low = 1.0, high = -1.0;
    for (int i = 0; i < 12'000; ++i) {
      const double x = body.position_m().x;
      const double read = std::round(x / at.resolution_m) * at.resolution_m;
      const double weight_n = 1.227;
      body.advance(1e-3, {wall.push_n(read, 1e-3) + weight_n, 0.0, 0.0}, {}, {});
      if (i < 10'000) continue;
      low = std::min(low, x);
      high = std::max(high, x);
    }
    // At rest: within two counts of the encoder.
    EXPECT_LE(high - low, 2.0 * at.resolution_m) << speed_m_per_s << " m/s";
    EXPECT_GT(low, 0.0) << "it must rest on the wall";
  }
}

}  // namespace
}  // namespace palpate::stability
