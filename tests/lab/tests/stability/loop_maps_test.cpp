// The outcomes of the maps at points inside, on and outside their borders. Oracle: the physics of
// the grip alone, and the work on the hand.
#include "tests/lab/stability/loop_maps.h"

#include <gtest/gtest.h>

namespace palpate::stability {
namespace {

std::string point(double x, double y) {
  return "at " + std::to_string(x) + ", " + std::to_string(y);
}

TEST(StiffnessMap, HoldsBelowTheLimitWithAndWithoutPalpate) {
  for (const double delay_s : {0.0, 1e-3, 3e-3})
    for (const Loop loop : {Loop::kPlain, Loop::kGuarded, Loop::kPalpate})
      EXPECT_EQ(loop_cell({.stiffness_share = 0.4, .delay_s = delay_s}, loop, 1).outcome,
                Outcome::kHeld)
          << delay_s << " loop " << int(loop);
}

TEST(StiffnessMap, HoldsOnTheLimitAndBeyondWhereTheDeviceSaysWhatItHolds) {
  for (const double delay_s : {1e-3, 3e-3})
    for (const double share : {1.0, 2.0, 6.0}) {
      const LoopPoint at{.stiffness_share = share, .delay_s = delay_s};
      EXPECT_NE(loop_cell(at, Loop::kPalpate, 2).outcome, Outcome::kSilent)
          << point(share, delay_s);
      EXPECT_EQ(loop_cell(at, Loop::kPlain, 2).outcome, Outcome::kSilent) << point(share, delay_s);
    }
}

TEST(DampingMap, FollowsTheDevicesOwnDamping) {
  for (const double damping : {0.3, 3.0}) {
    EXPECT_EQ(
        loop_cell({.stiffness_share = 1.4, .damping_n_s_per_m = damping}, Loop::kPlain, 3).outcome,
        Outcome::kSilent)
        << damping;
    EXPECT_NE(loop_cell({.stiffness_share = 1.4, .damping_n_s_per_m = damping}, Loop::kPalpate, 3)
                  .outcome,
              Outcome::kSilent)
        << damping;
  }
}

TEST(HandsMap, NeedsTheLimitMostWhereNoHandDamps) {
  // No hand, and a spring as a hand: beyond the limit the plain loop oscillates. A firm hand damps
  // it.
  for (const int hand : {0, 4}) {
    EXPECT_EQ(loop_cell({.stiffness_share = 2.0}, hand, Loop::kPlain, 4).outcome, Outcome::kSilent);
    EXPECT_EQ(loop_cell({.stiffness_share = 2.0}, hand, Loop::kPalpate, 4).outcome, Outcome::kHeld);
  }
  EXPECT_EQ(loop_cell({.stiffness_share = 2.0}, 3, Loop::kPlain, 4).outcome, Outcome::kHeld);
}

TEST(JitterMap, HoldsWhereThePeriodsAreUneven) {
  for (const double jitter_s : {0.0, 0.4e-3, 0.9e-3})
    for (const double share : {0.5, 1.0, 1.6})
      EXPECT_NE(
          loop_cell({.stiffness_share = share, .jitter_s = jitter_s}, Loop::kPalpate, 5).outcome,
          Outcome::kSilent)
          << point(jitter_s, share);
  EXPECT_EQ(loop_cell({.stiffness_share = 1.6, .jitter_s = 0.4e-3}, Loop::kPlain, 5).outcome,
            Outcome::kSilent);
}

TEST(EncoderMap, HoldsFromFineToCoarseSteps) {
  for (const double step_m : {1e-6, 38e-6, 200e-6})
    for (const double share : {0.4, 1.0, 4.0})
      EXPECT_NE(loop_cell({.stiffness_share = share, .resolution_m = step_m, .coulomb_n = 0.03},
                          Loop::kPalpate, 6)
                    .outcome,
                Outcome::kSilent)
          << point(step_m, share);
}

TEST(SwingMap, KeepsTheHandsConsentOnBothSidesOfTheBorder) {
  const double hz = 2.0, border_m = consented_amplitude_m(hz);
  EXPECT_NEAR(border_m, 0.0092, 0.0005);  // sqrt(2 0.05 / 7.45) / (2 pi 2)
  const Cell inside = swing_cell(hz, 0.25 * border_m, true, 10.0);
  EXPECT_EQ(inside.outcome, Outcome::kHeld);
  // The tank has 0.1 J: twice the border amplitude uses it up in some seconds.
  for (const double times : {2.0, 4.0}) {
    EXPECT_EQ(swing_cell(hz, times * border_m, true, 10.0).outcome, Outcome::kFlagged) << times;
    const Cell without = swing_cell(hz, times * border_m, false, 10.0);
    EXPECT_EQ(without.outcome, Outcome::kSilent) << times;
    EXPECT_GT(without.value, 0.1) << times;
  }
}

TEST(BeatMap, KeepsTheHandsConsentWhereDataBeatFast) {
  EXPECT_EQ(beat_cell(1.0, 600.0, true, 4.0).outcome, Outcome::kHeld);
  const Cell with = beat_cell(5.0, 4000.0, true, 8.0), without = beat_cell(5.0, 4000.0, false, 8.0);
  EXPECT_EQ(with.outcome, Outcome::kFlagged);
  EXPECT_EQ(with.value, 0.0);
  EXPECT_EQ(without.outcome, Outcome::kSilent);
}

}  // namespace
}  // namespace palpate::stability
