// Calibration of confidence, on counts that can be computed by hand.
#include "tests/lab/studies/reliability.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "compute/motion/quality.h"

namespace palpate::studies {
namespace {

constexpr double kExact = 1e-12;

TEST(Reliability, IsWhatTheBinsSay) {
  Reliability kept;
  for (int n = 0; n < 100; ++n) kept.add(0.75, n < 75);
  EXPECT_NEAR(kept.calibration_error(), 0.0, kExact);
  EXPECT_NEAR(kept.said(), 0.75, kExact);
  EXPECT_NEAR(kept.right(), 0.75, kExact);
  Reliability boasts = kept;
  for (int n = 0; n < 100; ++n) boasts.add(0.95, n < 45);
  // Half of the voxels have the right confidence, the others are off by a half.
  EXPECT_NEAR(boasts.calibration_error(), 0.25, kExact);
  EXPECT_NEAR(boasts.right(), 0.6, kExact);
}

TEST(Reliability, HasABinForEachEndAndForWhatIsNoNumber) {
  Reliability ends;
  ends.add(1.0, true);
  ends.add(1.5, true);
  ends.add(0.0, false);
  ends.add(std::numeric_limits<double>::quiet_NaN(), false);
  EXPECT_EQ(ends.bins().back().voxels, 2.0);
  EXPECT_EQ(ends.bins().front().voxels, 2.0);
  EXPECT_NEAR(ends.calibration_error(), 0.0, kExact);
  EXPECT_TRUE(std::isnan(Reliability().calibration_error()));
}

TEST(Reliability, CountsPairsAlikeHoweverLarge) {
  Reliability large, small, both;
  for (int n = 0; n < 1000; ++n) large.add(0.9, true);
  small.add(0.9, false);
  both.add_evenly(large);
  both.add_evenly(small);
  both.add_evenly(Reliability());
  EXPECT_NEAR(both.voxels(), 2.0, kExact);
  EXPECT_NEAR(both.right(), 0.5, kExact);
}

TEST(ReliabilityOf, HoldsTheFieldAgainstTheTruthInsideTheMask) {
  Grid grid;
  grid.size = {4, 3, 2};
  const Field truth = still_field(grid);
  Field found = truth;
  Confidence confidence{grid, std::vector<float>(grid.count(), 0.85F)};
  Mask mask{grid, std::vector<uint8_t>(grid.count(), 1)};
  for (const size_t at : {size_t(0), size_t(5)}) {
    found.u_mm[at] = {0.0F, 2.0F, 0.0F};
    confidence.values[at] = 0.15F;
  }
  found.u_mm[7] = {9.0F, 0.0F, 0.0F};
  mask.values[7] = 0;
  const Reliability all = reliability_of(found, confidence, truth, &mask, 0.5);
  EXPECT_EQ(all.voxels(), double(grid.count() - 1));
  EXPECT_EQ(all.bins()[1].voxels, 2.0);
  EXPECT_EQ(all.bins()[1].right, 0.0);
  EXPECT_EQ(all.bins()[8].voxels, double(grid.count() - 3));
  EXPECT_EQ(all.bins()[8].right, double(grid.count() - 3));
  EXPECT_EQ(reliability_of(found, confidence, truth, nullptr, 0.5).voxels(), double(grid.count()));
}

TEST(RadiiOf, HoldsTheErrorsAgainstTheRadiiInsideTheMask) {
  Grid grid;
  grid.size = {10, 4, 1};
  const Field truth = still_field(grid);
  Field found = truth;
  Deviation deviation{grid, std::vector<glm::vec2>(grid.count(), {0.3F, 0.4F})};
  Mask mask{grid, std::vector<uint8_t>(grid.count(), 1)};
  const double radius = error_radius_mm(glm::dvec2(0.3F, 0.4F));
  // Four of 36 voxels are off by twice the radius; four others by more, and do not count.
  for (const size_t at : {3, 13, 23, 33}) found.u_mm[at] = {0.0F, float(2.0 * radius), 0.0F};
  for (const size_t at : {0, 10, 20, 30}) {
    found.u_mm[at] = {9.0F, 0.0F, 0.0F};
    mask.values[at] = 0;
  }
  const Radii radii = radii_of(found, deviation, truth, mask, 2.0);
  EXPECT_NEAR(radii.said, 0.5 * radius, 1e-5);
  EXPECT_NEAR(radii.truth, radius, 1e-5);  // twice the radius, in voxels of 2 mm
  EXPECT_NEAR(radii.inside, 32.0 / 36.0, kExact);
  EXPECT_NEAR(radii.inside_own, 32.0 / 36.0, kExact);
  // Where it is known that they are off they lie within their own radius.
  for (const size_t at : {3, 13, 23, 33}) deviation.mm[at] *= 3.0F;
  EXPECT_NEAR(radii_of(found, deviation, truth, mask, 2.0).inside_own, 1.0, kExact);
  EXPECT_EQ(radii_table({{"made", radii}}, "").rows.size(), 1u);
}

TEST(ReliabilityChart, DrawsBinsThatHoldEnoughAndTheDiagonal) {
  Reliability r;
  for (int n = 0; n < 5000; ++n) r.add(0.95, n % 10 != 0);
  r.add(0.05, false);
  const report::Chart chart = reliability_chart({{"made", r}}, "Calibration of confidence");
  ASSERT_EQ(chart.series.size(), 2u);
  ASSERT_EQ(chart.series[1].points.size(), 1u);
  EXPECT_NEAR(chart.series[1].points[0].x, 0.95, kExact);
  EXPECT_NEAR(chart.series[1].points[0].y, 0.9, kExact);
  EXPECT_EQ(reliability_table({{"made", r}}, "").rows.size(), 1u);
}

}  // namespace
}  // namespace palpate::studies
