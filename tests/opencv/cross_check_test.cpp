#include "integration/opencv/cross_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "compute/volume/phantom.h"
#include "tests/motion/quality_fields.h"

namespace palpate::opencv {
namespace {

using test::field_of;
using test::grid_at_origin;
using test::tissue_at;
using test::volume_of;
using ::testing::HasSubstr;

/// The largest median, in voxels, of the better method over the orientations.
double worst_median(const CrossCheck& check) {
  double worst = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    double best = 1e9;
    for (const FlowComparison& c : check.comparisons) {
      if (c.normal_axis == axis) best = std::min(best, c.difference.voxels.median);
    }
    worst = std::max(worst, best);
  }
  return worst;
}

/// Tissue of 5 mm structures on a grid, before and after a shift.
struct Shifted {
  Grid grid;
  glm::dvec3 shift_mm;
  Volume fixed = volume_of(grid, [](glm::dvec3 p) { return tissue_at(5, p); });
  Volume moving = volume_of(grid, [this](glm::dvec3 p) { return tissue_at(5, p - shift_mm); });
  Field truth = field_of(coarsened(grid, {4, 4, 4}), [this](glm::dvec3) { return shift_mm; });
};

TEST(CrossCheck, ATrueShiftAgreesInAllOrientationsWithBothMethods) {
  // 0.4 mm are below the limit of half a voxel through the slices in every orientation.
  const Shifted pair{grid_at_origin(56), {0.4, -0.35, 0.3}};
  const auto check = cross_check(pair.fixed, pair.moving, pair.truth);
  ASSERT_TRUE(check);
  ASSERT_EQ(check->comparisons.size(), 6u);
  for (const FlowComparison& c : check->comparisons) {
    EXPECT_EQ(c.slices, 12u);
    EXPECT_EQ(c.pixels, 12u * 56u * 56u);
    EXPECT_GT(c.share(), 0.3);
    // The known accuracy of optical flow (0.05 to 0.3 pixel), plus the effect of 0.4 voxel through
    // the slice on structures of 5 voxels.
    EXPECT_LT(c.difference.voxels.median, 0.25) << c.normal_axis << ' ' << name(c.method);
  }
  EXPECT_EQ(check->agreement, Agreement::kAgree) << check->summary;
}

TEST(CrossCheck, WhatMovesThroughTheSlicesIsNotCompared) {
  const Shifted pair{grid_at_origin(56), {0.0, 0.0, 3.0}};
  const auto check = cross_check(pair.fixed, pair.moving, pair.truth);
  ASSERT_TRUE(check);
  for (const FlowComparison& c : check->comparisons) {
    if (c.normal_axis == 2) {
      EXPECT_EQ(c.compared, 0u);
    } else {
      EXPECT_GT(c.compared, 5000u);
      EXPECT_LT(c.difference.voxels.median, 0.2);
      EXPECT_NEAR(c.motion_voxels, 3.0, 1e-4);
    }
  }
  EXPECT_EQ(check->agreement, Agreement::kAgree);
  EXPECT_LT(check->share_compared, 0.67);
}

TEST(CrossCheck, AWrongFieldDisagrees) {
  const Shifted pair{grid_at_origin(56), {0.0, 0.0, 3.0}};
  const auto none = cross_check(pair.fixed, pair.moving, still_field(pair.grid));
  EXPECT_EQ(none->agreement, Agreement::kDisagree) << none->summary;
  EXPECT_THAT(none->summary, HasSubstr("disagrees"));
  const Field mirrored = field_of(pair.grid, [](glm::dvec3) { return glm::dvec3(0.0, 0.0, -3.0); });
  EXPECT_EQ(cross_check(pair.fixed, pair.moving, mirrored)->agreement, Agreement::kDisagree);
}

TEST(CrossCheck, AFieldThatIsWrongInOnePlaceOnlyDisagrees) {
  const Shifted pair{grid_at_origin(56), {0.0, 0.0, 3.0}};
  Field field = field_of(pair.grid, [](glm::dvec3) { return glm::dvec3(0.0, 0.0, 3.0); });
  for (int k = 16; k < 40; ++k)
    for (int j = 16; j < 40; ++j)
      for (int i = 0; i < 56; ++i) field.u_mm[pair.grid.offset(i, j, k)].z = -1.0F;
  const auto check = cross_check(pair.fixed, pair.moving, field);
  EXPECT_LT(worst_median(*check), 0.5);
  EXPECT_EQ(check->agreement, Agreement::kDisagree) << check->summary;
}

TEST(CrossCheck, AnEmptyMovingFrameCanNotTell) {
  const Shifted pair{grid_at_origin(56), {0.0, 0.0, 0.0}};
  const Volume empty = volume_of(pair.grid, [](glm::dvec3) { return 0.0; });
  const auto check = cross_check(pair.fixed, empty, pair.truth);
  EXPECT_EQ(check->agreement, Agreement::kCanNotTell) << check->summary;
}

TEST(CrossCheck, HonoursSpacingAndDirection) {
  Grid grid;
  grid.size = {60, 52, 24};
  grid.spacing_mm = {0.9, 1.0, 2.4};
  grid.direction = test::some_rotation(6);
  grid.origin_mm = {10.0, -40.0, 25.0};
  // Along the coarsest axis of the grid, which is not an axis of LPS.
  const glm::dvec3 shift_mm = grid.direction * glm::dvec3(0.2, 0.3, 2.0);
  const Shifted pair{grid, shift_mm};
  const auto check = cross_check(pair.fixed, pair.moving, pair.truth);
  ASSERT_TRUE(check);
  for (const FlowComparison& c : check->comparisons) {
    if (c.normal_axis == 2) continue;
    EXPECT_GT(c.compared, 2000u);
    EXPECT_NEAR(c.motion_voxels * 0.9, 2.0, 0.05);
    // Structures of 5 mm are small for slices of 2.4 mm, for both methods: a third of a voxel of
    // 0.9 mm.
    EXPECT_LT(c.difference.mm.median, 0.3) << name(c.method);
  }
}

TEST(CrossCheck, DoesNotMindAGainChange) {
  Shifted pair{grid_at_origin(56), {0.0, 2.0, 0.3}};
  for (float& value : pair.moving.values) value = 0.7F * value - 300.0F;
  const auto check = cross_check(pair.fixed, pair.moving, pair.truth);
  EXPECT_EQ(check->agreement, Agreement::kAgree) << check->summary;
  EXPECT_LT(worst_median(*check), 0.25);
}

TEST(CrossCheck, TheBeatingHeartAgreesWhereItCanBeCompared) {
  const Sequence beat = shell_phantom(64);
  const Grid grid = heart_grid(64);
  const auto check = cross_check(beat.frames[0], beat.frames[1], shell_truth(grid, 0, 1));
  EXPECT_EQ(check->agreement, Agreement::kAgree) << check->summary;
  EXPECT_GT(check->share_compared, 0.005);
}

TEST(CrossCheck, FramesWithoutStructureCanNotTell) {
  Volume flat = volume_of(grid_at_origin(40), [](glm::dvec3) { return 10.0; });
  const auto of_flat = cross_check(flat, flat, still_field(flat.grid));
  EXPECT_EQ(of_flat->agreement, Agreement::kCanNotTell);
  EXPECT_THAT(of_flat->summary, HasSubstr("can not tell"));
  for (size_t n = 0; n < flat.values.size(); ++n)
    flat.values[n] += float(texture::gaussian_like(2, n));
  EXPECT_EQ(cross_check(flat, flat, still_field(flat.grid))->agreement, Agreement::kCanNotTell);
}

TEST(CrossCheck, LeavesOutSlicesThatAreTooSmall) {
  Grid thin = grid_at_origin(48);
  thin.size.z = 10;
  const Shifted pair{thin, {0.5, 0.5, 0.0}};
  const auto check = cross_check(pair.fixed, pair.moving, pair.truth);
  ASSERT_EQ(check->comparisons.size(), 2u);
  EXPECT_EQ(check->comparisons[0].normal_axis, 2);
  EXPECT_EQ(check->comparisons[0].slices, 10u);
}

TEST(CrossCheck, LooksOnlyInsideTheMask) {
  const Shifted pair{grid_at_origin(48), {0.0, 0.0, 0.4}};
  Mask half{pair.grid, std::vector<uint8_t>(pair.grid.count())};
  for (size_t n = 0; n < half.values.size() / 2; ++n) half.values[n] = 1;
  const auto check = cross_check(pair.fixed, pair.moving, pair.truth, {}, &half);
  ASSERT_TRUE(check);
  for (const FlowComparison& c : check->comparisons) EXPECT_EQ(c.pixels, 6u * 48u * 48u);
  const Mask elsewhere = test::whole(grid_at_origin(5));
  EXPECT_FALSE(cross_check(pair.fixed, pair.moving, pair.truth, {}, &elsewhere));
}

}  // namespace
}  // namespace palpate::opencv
