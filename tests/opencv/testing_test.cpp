#include "integration/opencv/testing.h"

#include <gtest/gtest.h>

#include <limits>

#include "compute/volume/phantom.h"
#include "tests/motion/quality_fields.h"

namespace palpate::testing {
namespace {

using test::field_of;
using test::grid_at_origin;
using test::tissue_at;
using test::volume_of;
using ::testing::HasSubstr;
using ::testing::Not;

std::string explained(const FieldMatcher& matcher, const Field& field) {
  ::testing::StringMatchResultListener listener;
  matcher.MatchAndExplain(field, &listener);
  return listener.str();
}

TEST(HasNoFolds, MatchesTheHeartAndNotAMirror) {
  EXPECT_THAT(shell_truth(heart_grid(32), 0, 1), HasNoFolds());
  const Field mirror =
      field_of(grid_at_origin(8), [](glm::dvec3 p) { return glm::dvec3(-2.0 * p.x, 0, 0); });
  EXPECT_THAT(mirror, Not(HasNoFolds()));
  EXPECT_THAT(explained(HasNoFolds(), mirror), HasSubstr("folds at 512 of 512 samples"));
}

TEST(IsWithin, ComparesTheMeanInVoxels) {
  const Grid grid = grid_at_origin(8, 2.0);
  const Field off = field_of(grid, [](glm::dvec3) { return glm::dvec3(1.0, 0.0, 0.0); });
  const Field truth = still_field(grid);
  EXPECT_THAT(off, IsWithin(truth, 0.51));
  EXPECT_THAT(off, Not(IsWithin(truth, 0.49)));
  EXPECT_THAT(explained(IsWithin(truth, 0.49), off), HasSubstr("off by 0.5 voxels on average"));
}

TEST(IsWithin, LooksOnlyInsideItsMask) {
  const Grid grid = grid_at_origin(8);
  Field off = still_field(grid);
  off.u_mm[0].x = 9.0F;
  EXPECT_THAT(off, IsWithin(still_field(grid), test::whole(grid, 2), 0.0));
  EXPECT_THAT(off, Not(IsWithin(still_field(grid), test::whole(grid), 0.0)));
}

TEST(IsWithin, NeverMatchesWhatCanNotBeCompared) {
  const Grid grid = grid_at_origin(8);
  Field broken = still_field(grid);
  broken.u_mm[3].x = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(broken, Not(IsWithin(still_field(grid), 1.0)));
  const Field empty{grid, {}};
  EXPECT_THAT(empty, Not(IsWithin(still_field(grid), 1.0)));
  EXPECT_THAT(explained(HasNoFolds(), empty), HasSubstr("0 vectors for 512 samples"));
  const Mask none{grid, std::vector<uint8_t>(grid.count())};
  EXPECT_THAT(still_field(grid), Not(IsWithin(still_field(grid), none, 1.0)));
}

TEST(IsUndoneBy, MatchesTheBeatBack) {
  const Grid grid = heart_grid(32);
  // Interpolation at 4 mm: a few hundredths of a voxel, see InverseConsistency.
  EXPECT_THAT(shell_truth(grid, 0, 1), IsUndoneBy(shell_truth(grid, 1, 0), 0.05));
  EXPECT_THAT(shell_truth(grid, 0, 1), Not(IsUndoneBy(still_field(grid), 0.05)));
}

TEST(AgreesWithOpticalFlow, MatchesTheTrueShiftAndExplainsAWrongOne) {
  const Grid grid = grid_at_origin(48);
  const glm::dvec3 shift(0.0, 2.0, 0.2);
  const Volume fixed = volume_of(grid, [](glm::dvec3 p) { return tissue_at(6, p); });
  const Volume moving = volume_of(grid, [&](glm::dvec3 p) { return tissue_at(6, p - shift); });
  const FieldMatcher agrees = AgreesWithOpticalFlow(fixed, moving);
  EXPECT_THAT(field_of(grid, [&](glm::dvec3) { return shift; }), agrees);
  const Field wrong = field_of(grid, [&](glm::dvec3) { return -shift; });
  EXPECT_THAT(wrong, Not(agrees));
  EXPECT_THAT(explained(agrees, wrong), HasSubstr("slices across axis 2, Farneback: median"));
}

TEST(AgreesWithOpticalFlow, DoesNotMatchWithoutEvidence) {
  const Volume flat = volume_of(grid_at_origin(40), [](glm::dvec3) { return 1.0; });
  EXPECT_THAT(still_field(flat.grid), Not(AgreesWithOpticalFlow(flat, flat)));
}

}  // namespace
}  // namespace palpate::testing
