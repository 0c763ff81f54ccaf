// The outcomes of the maps at points inside, on and outside their borders. Oracle: the field
// itself, evaluated for every point that is found, and Banach's condition q phase < 1.
#include "tests/lab/stability/back_track_maps.h"

#include <gtest/gtest.h>

namespace palpate::stability {
namespace {

constexpr BackTracking kOurs = BackTracking::kNewton, kPapers = BackTracking::kPicard;

TEST(StretchMap, HoldsAtAnyContractionWhereThePapersFixedPointEndsAtOne) {
  for (const double q : {0.0, 0.5, 0.9, 1.0, 1.2, 3.0}) {
    const Cell ours = search_cell(Flow::kStretch, q, 1.0, kOurs, 1);
    EXPECT_EQ(ours.outcome, Outcome::kHeld) << q;
    EXPECT_EQ(ours.value, 0.0) << q;
  }
  // Up to 0.8 it converges within its 64 steps; at 1 and beyond it can not.
  EXPECT_EQ(search_cell(Flow::kStretch, 0.8, 1.0, kPapers, 1).outcome, Outcome::kHeld);
  for (const double q : {1.0, 1.5, 3.0}) {
    const Cell papers = search_cell(Flow::kStretch, q, 1.0, kPapers, 1);
    EXPECT_EQ(papers.outcome, Outcome::kSilent) << q;
    EXPECT_GT(papers.value, 90.0) << q;
  }
  // The product with the phase counts.
  EXPECT_EQ(search_cell(Flow::kStretch, 3.0, 0.2, kPapers, 1).outcome, Outcome::kHeld);
}

TEST(PressMap, RefusesWhatIsPressedToAPointOrTurnedInsideOut) {
  EXPECT_EQ(search_cell(Flow::kPress, 0.9, 1.0, kOurs, 2).outcome, Outcome::kHeld);
  EXPECT_EQ(search_cell(Flow::kPress, 2.0, 0.45, kOurs, 2).outcome, Outcome::kHeld);
  for (const double q : {1.0, 1.3, 3.0})
    EXPECT_EQ(search_cell(Flow::kPress, q, 1.0, kOurs, 2).outcome, Outcome::kFlagged) << q;
  // At exactly 1 all material is in one point and any result fits; beyond, none does.
  for (const double q : {1.3, 3.0})
    EXPECT_EQ(search_cell(Flow::kPress, q, 1.0, kPapers, 2).outcome, Outcome::kSilent) << q;
}

TEST(WavesMap, IsNeverWrongUnseen) {
  for (uint32_t seed = 1; seed <= 6; ++seed) {
    for (const double q : {0.5, 0.95}) {
      EXPECT_EQ(search_cell(Flow::kWaves, q, 1.0, kOurs, seed).outcome, Outcome::kHeld)
          << "seed " << seed << " q " << q;
    }
    for (const double q : {1.0, 1.5, 2.0, 3.0}) {
      EXPECT_NE(search_cell(Flow::kWaves, q, 1.0, kOurs, seed).outcome, Outcome::kSilent)
          << "seed " << seed << " q " << q;
    }
  }
  // Beyond the border there must be failures; else the test above checks nothing.
  EXPECT_EQ(search_cell(Flow::kWaves, 3.0, 1.0, kOurs, 1).outcome, Outcome::kFlagged);
  EXPECT_EQ(search_cell(Flow::kWaves, 3.0, 1.0, kPapers, 1).outcome, Outcome::kSilent);
}

TEST(StrokeMap, HoldsWhereTheMotionIsGentleAndSaysSoWhereItFolds) {
  const Cell inside = stroke_cell(0.25, 0.02, true, 3);
  EXPECT_EQ(inside.outcome, Outcome::kHeld) << inside.value;
  for (const double q : {1.0, 3.0}) {
    // The force never jumps: at most 0.05 N per millisecond, everywhere.
    const Cell ours = stroke_cell(q, 0.02, true, 3);
    EXPECT_NE(ours.outcome, Outcome::kSilent) << q;
    EXPECT_LE(ours.value, 0.05 + 1e-9) << q;
  }
  EXPECT_EQ(stroke_cell(3.0, 0.02, true, 3).outcome, Outcome::kFlagged);
  EXPECT_EQ(stroke_cell(3.0, 0.02, false, 3).outcome, Outcome::kSilent);
}

TEST(DartMap, LetsNoHandThroughOnEitherSideOfTheBorder) {
  for (const double hand : {0.1, 1.0, 2.0})
    for (const double wall : {0.0, 0.3})
      EXPECT_EQ(dart_cell(hand, wall, true, 3000, 5).outcome, Outcome::kHeld)
          << hand << " m/s, wall " << wall;
  // The paper's loop samples once per tick: it does not detect a wall that it crosses in between.
  EXPECT_EQ(dart_cell(2.0, 0.0, false, 3000, 5).outcome, Outcome::kSilent);
}

}  // namespace
}  // namespace palpate::stability
