// The outcomes of the maps at points inside, on and outside their borders, on 48^3 voxels. Oracle:
// the true motion of the pairs.
#include "tests/lab/stability/motion_maps.h"

#include <gtest/gtest.h>

#include "tests/support/device.h"

namespace palpate::stability {
namespace {

constexpr int kSize = 48;

class MotionMaps : public test::DeviceTest {
 protected:
  Cell ours(const MotionPair& pair, Colour colour = Colour::kError) {
    return motion_cell(context(), pair, true, colour);
  }
  Cell classic(const MotionPair& pair, Colour colour = Colour::kError) {
    return motion_cell(context(), pair, false, colour);
  }
};

TEST_F(MotionMaps, HoldHalfAStructureOfMotionAndFlagWhatIsFarBeyond) {
  EXPECT_EQ(ours(shifted_pair(kSize, 1.5, 6.0, 1)).outcome, Outcome::kHeld);
  EXPECT_EQ(ours(shifted_pair(kSize, 3.0, 6.0, 1)).outcome, Outcome::kHeld);
  EXPECT_NE(ours(shifted_pair(kSize, 16.0, 6.0, 1)).outcome, Outcome::kSilent);
  EXPECT_EQ(classic(shifted_pair(kSize, 16.0, 6.0, 1)).outcome, Outcome::kSilent);
}

TEST_F(MotionMaps, HoldUnderAnotherLightWhereClassicDoesNot) {
  for (const double more_gain : {0.02, 0.5}) {
    const MotionPair pair = lit_pair(kSize, more_gain, 0.3, 2);
    EXPECT_EQ(ours(pair).outcome, Outcome::kHeld) << more_gain;
  }
  EXPECT_EQ(classic(lit_pair(kSize, 0.5, 0.3, 2)).outcome, Outcome::kSilent);
}

TEST(LitPair, HasItsGainAndItsBiasInTheMovingFrameAlone) {
  constexpr int kSmall = 16;
  const MotionPair plain = noisy_pair(kSmall, 0.02, 3.0, 2), lit = lit_pair(kSmall, 0.5, 0.3, 2);
  const Grid& grid = plain.fixed.grid;
  EXPECT_EQ(lit.fixed.values, plain.fixed.values);
  for (const int i : {0, 5, kSmall - 1}) {
    const size_t at = grid.offset(i, 3, 7);
    // 600 is the range of a body's intensities; the tolerance is for values of about 1000 in single
    // precision.
    EXPECT_NEAR(lit.moving.values[at],
                1.5 * double(plain.moving.values[at]) + 0.3 * 600.0 * i / (kSmall - 1.0), 1e-3);
  }
}

TEST_F(MotionMaps, HoldUnderALittleNoiseAndFlagMuch) {
  EXPECT_EQ(ours(noisy_pair(kSize, 0.05, 3.0, 3)).outcome, Outcome::kHeld);
  EXPECT_NE(ours(noisy_pair(kSize, 1.0, 3.0, 3)).outcome, Outcome::kSilent);
  EXPECT_EQ(ours(noisy_pair(kSize, 3.0, 3.0, 3)).outcome, Outcome::kFlagged);
  EXPECT_EQ(classic(noisy_pair(kSize, 3.0, 3.0, 3)).outcome, Outcome::kSilent);
}

TEST_F(MotionMaps, NeverFoldHoweverSteepTheTruthIs) {
  for (const double gradient : {0.4, 1.0, 2.0}) {
    const Cell cell = ours(folding_pair(kSize, gradient, 20.0, 4), Colour::kFolds);
    EXPECT_EQ(cell.value, 0.0) << gradient;
  }
  EXPECT_EQ(ours(folding_pair(kSize, 0.3, 40.0, 4), Colour::kFolds).outcome, Outcome::kHeld);
  EXPECT_EQ(ours(folding_pair(kSize, 2.0, 40.0, 4), Colour::kFolds).outcome, Outcome::kFlagged);
}

TEST_F(MotionMaps, HoldOnBothSidesOfASlideBeyondTwoCells) {
  const MotionPair pair = sliding_pair(kSize, 4.0, 5);
  const Found found = found_by(context(), pair, true);
  const Score far = scored(found, scored_at(pair, 12.5)),
              near = scored(found, scored_at(pair, 0.5));
  EXPECT_LT(far.mean_voxels, 0.3);
  // At the face itself no field that is smooth over a cell can be right: a known limit.
  EXPECT_GT(near.mean_voxels, far.mean_voxels);
  EXPECT_EQ(motion_cell(found, scored_at(pair, 12.5), true, Colour::kError).outcome,
            Outcome::kHeld);
}

TEST_F(MotionMaps, HoldARepeatedFrameAndMissingOnes) {
  for (const int left_out : {-1, 0, 2})
    EXPECT_EQ(ours(heart_pair(kSize, left_out, 2, 6)).outcome, Outcome::kHeld) << left_out;
}

TEST_F(MotionMaps, HoldThickSlicesWithTwoOfThemInAStructure) {
  EXPECT_EQ(ours(thick_pair(kSize, 1.0, 8.0, 7)).outcome, Outcome::kHeld);
  EXPECT_EQ(ours(thick_pair(kSize, 4.0, 8.0, 7)).outcome, Outcome::kHeld);
}

TEST_F(MotionMaps, TrustAFlatRegionLessTheFurtherStructureIs) {
  // If there is only noise within the narrow window (2.5 voxels) the field is a guess, however
  // smooth: the probability that it is right is at most one half. Noise sometimes looks like
  // structure, so this holds for most cells about the middle, not for each. Nearer to structure the
  // confidence can not show this.
  constexpr int kAbout = 5;  // cells of two voxels
  const auto trusted = [&](double radius, double above_what) {
    const MotionPair pair = flat_pair(64, radius, 1.0, 8);
    const Found found = found_by(context(), pair, true);
    const Grid& grid = found.confidence.grid;
    size_t above = 0, cells = 0;
    for (int k = -kAbout; k <= kAbout; ++k)
      for (int j = -kAbout; j <= kAbout; ++j)
        for (int i = -kAbout; i <= kAbout; ++i) {
          const glm::ivec3 at = grid.size / 2 + glm::ivec3(i, j, k);
          ++cells;
          if (found.confidence.values[grid.offset(at.x, at.y, at.z)] > float(above_what)) ++above;
        }
    return double(above) / double(cells);
  };
  const double small = trusted(4.0, 0.9), wide = trusted(24.0, kLowConfidence);
  EXPECT_EQ(small, 1.0);
  EXPECT_LT(wide, 0.5);
  RecordProperty("trusted", std::to_string(wide));
}

}  // namespace
}  // namespace palpate::stability
