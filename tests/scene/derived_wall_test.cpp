// Walls derived from values. Oracle: balls and planes whose distance is known, and real data.
#include "module/scene/derived_wall.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "integration/files/read_volume.h"
#include "tests/scene/ball_frames.h"

namespace palpate {
namespace {

using test::edge;
using test::spotted_ball;
constexpr double kRadius_mm = test::kBallRadius_mm;
constexpr double kHalf_mm = 6.0;  // of a heart on a usual device

double at(const Volume& distance_mm, glm::dvec3 x) {
  return sample(distance_mm, distance_mm.grid.index_from_lps(x));
}

/// The distance of the surface from a ball's, along the six axes and four diagonals.
double off_the_ball_mm(const Volume& distance_mm) {
  double most = 0.0;
  for (const glm::dvec3 way :
       {glm::dvec3(1, 0, 0), glm::dvec3(-1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, -1, 0),
        glm::dvec3(0, 0, 1), glm::dvec3(0, 0, -1), glm::dvec3(1, 1, 1), glm::dvec3(-1, 1, -1),
        glm::dvec3(1, -1, -1), glm::dvec3(-1, -1, 1)}) {
    double out_mm = 0.0;
    while (out_mm < 30.0 && at(distance_mm, out_mm * glm::normalize(way)) > 0.0) out_mm += 0.05;
    most = std::max(most, std::abs(out_mm - kRadius_mm));
  }
  return most;
}

TEST(DerivedWall, RegionClosesWhatSpotsHaveOpened) {
  const Volume frame = spotted_ball();
  EXPECT_GT(wall_of(frame).ends, kClosedWall);
  const auto wall = region_wall(frame, 0.0);
  ASSERT_TRUE(wall);
  // The smallest Gaussian that is sufficient.
  EXPECT_LE(wall->ends, 0.1);
  EXPECT_GT(wall->smooth_mm, wall_scale(frame.grid));
  const auto weaker = region_wall(frame, 0.0, {}, wall->smooth_mm - wall_scale(frame.grid));
  ASSERT_TRUE(weaker);
  EXPECT_GT(weaker->ends, 0.1);
  EXPECT_LT(off_the_ball_mm(wall->distance_mm), 3.0);  // not a spot
  EXPECT_GT(at(wall->distance_mm, {0.0, 0.0, 10.0}), 4.0);
  EXPECT_LT(at(wall->distance_mm, {0.0, 26.0, 0.0}), -4.0);
}

/// A ball with a crack of 5 mm from its middle to its right end, and with a plate of 5 mm above it.
Volume cracked_ball() {
  return test::frame_of([](glm::dvec3 x) {
    const double ball = edge(kRadius_mm - glm::length(x));
    const double crack = edge(2.5 - std::abs(x.y)) * edge(x.x);
    const double plate = edge(2.5 - std::abs(x.z - 17.0)) * edge(28.0 - std::hypot(x.x, x.y));
    return 1000.0 * std::max(ball - crack, plate);
  });
}

TEST(DerivedWall, RegionHasNoNotchAndNoThinPartWhereAHandWouldFall) {
  const Volume frame = cracked_ball();
  const glm::dvec3 in_crack(12.0, 0.0, 0.0), in_plate(24.0, 0.0, 17.0);
  const auto any = region_wall(frame, 0.0, 500.0, 1.0);
  ASSERT_TRUE(any);
  EXPECT_LT(at(any->distance_mm, in_crack), -1.0);
  EXPECT_GT(at(any->distance_mm, in_plate), 1.0);
  EXPECT_EQ(any->closed_mm, 0.0);
  EXPECT_EQ(any->opened_mm, 0.0);
  const auto wall = region_wall(frame, 4.0, 500.0, 1.0);
  ASSERT_TRUE(wall);
  EXPECT_DOUBLE_EQ(wall->closed_mm, 6.0);
  EXPECT_DOUBLE_EQ(wall->opened_mm, 4.0);
  EXPECT_GT(at(wall->distance_mm, in_crack), 3.0);
  EXPECT_LT(at(wall->distance_mm, in_plate), -2.0);
  EXPECT_NEAR(at(wall->distance_mm, {-kRadius_mm, 0.0, 0.0}), 0.0, 0.5);
  EXPECT_LT(wall->ends, any->ends);
  // Balls that would leave nothing become smaller.
  const Volume thin =
      test::frame_of([](glm::dvec3 x) { return 1000.0 * edge(5.0 - std::abs(x.z)); });
  const auto plate = region_wall(thin, 8.0, 500.0, 0.0);
  ASSERT_TRUE(plate);
  EXPECT_GT(plate->opened_mm, 3.0);
  EXPECT_LT(plate->opened_mm, 5.0);
  EXPECT_GT(at(plate->distance_mm, {0.0, 0.0, 0.0}), 3.0);
}

TEST(DerivedWall, IsLostWhereItIsNotAsDeepAsAHandNeeds) {
  // A distance to a plate of 10 mm: 5 mm deep.
  const Volume plate = test::frame_of([](glm::dvec3 x) { return 5.0 - std::abs(x.z); });
  EXPECT_EQ(wall_quality(plate, {0.0, 1.0}).ends, 0.0);
  EXPECT_EQ(wall_quality(plate, {0.0, 1.0}, 3.0).ends, 0.0);
  EXPECT_EQ(wall_quality(plate, {0.0, 1.0}, 6.0).ends, 1.0);
}

TEST(DerivedWall, RegionIsSmoothedNoMoreThanItNeeds) {
  const Volume clean =
      test::frame_of([](glm::dvec3 x) { return 1000.0 * edge(kRadius_mm - glm::length(x)); });
  const auto wall = region_wall(clean, 0.0);
  ASSERT_TRUE(wall);
  EXPECT_DOUBLE_EQ(wall->smooth_mm, wall_scale(clean.grid));  // of 1 mm
  EXPECT_LT(off_the_ball_mm(wall->distance_mm), 0.3);
  const auto asked = region_wall(clean, 0.0, 700.0, 0.0);
  ASSERT_TRUE(asked);
  EXPECT_EQ(asked->smooth_mm, 0.0);
  EXPECT_EQ(asked->iso_value, 700.0);
}

TEST(DerivedWall, RegionLeavesOutCrumbsAndFillsBubbles) {
  const Volume frame = test::frame_of([](glm::dvec3 x) {
    const double ball = edge(kRadius_mm - glm::length(x));
    const double bubble = edge(4.0 - glm::length(x - glm::dvec3(5, 0, 0)));
    const double crumb = edge(2.5 - glm::length(x - glm::dvec3(0, 26, 0)));
    return 1000.0 * std::max(ball - bubble, crumb);
  });
  const auto wall = region_wall(frame, 0.0);
  ASSERT_TRUE(wall);
  EXPECT_GT(at(wall->distance_mm, {5.0, 0.0, 0.0}), 5.0);
  EXPECT_LT(at(wall->distance_mm, {0.0, 26.0, 0.0}), -4.0);
}

TEST(DerivedWall, RegionHasNoWallAtTheEndsOfTheData) {
  // Brighter from x = 4 mm to the end of the data, in slices of 4 mm.
  const Volume frame =
      test::frame_of([](glm::dvec3 x) { return 1000.0 * edge(x.x - 4.0); }, {1.0, 1.0, 4.0});
  const auto wall = region_wall(frame, 0.0);
  ASSERT_TRUE(wall);
  const Volume& d = wall->distance_mm;
  const glm::dvec3 last = d.grid.lps_from_index(glm::dvec3(d.grid.size - 1));
  const glm::dvec3 end = frame.grid.lps_from_index(glm::dvec3(frame.grid.size - 1));
  EXPECT_LT(glm::length(last - end), 1e-6);
  for (const glm::dvec3 x : {glm::dvec3(12, 0, 0), glm::dvec3(12, 31, 0), glm::dvec3(12, -31, 29),
                             glm::dvec3(12, 0, -29)})
    EXPECT_NEAR(at(d, x), 8.0, 0.6) << x.x << ' ' << x.y << ' ' << x.z;
  EXPECT_GT(at(d, {31.0, 0.0, 0.0}), 4.0);
}

TEST(DerivedWall, RidgesFindABorderThatNoValueTells) {
  // The bias of the scanner makes the left side twice as bright as the right: the outside there is
  // brighter than the inside here.
  const Volume frame = test::frame_of([](glm::dvec3 x) {
    return (100.0 + 60.0 * edge(kRadius_mm - glm::length(x))) * (1.0 - 0.015 * x.x);
  });
  const auto by_value = region_wall(frame, 0.0, {}, 1.0);
  ASSERT_TRUE(by_value);
  EXPECT_GT(off_the_ball_mm(by_value->distance_mm), 5.0);
  const auto wall = ridge_wall(frame, 0.0, {}, 1.0);
  ASSERT_TRUE(wall);
  EXPECT_LT(off_the_ball_mm(wall->distance_mm), 0.6);
  // A distance: at the wall it changes by 1 mm per mm.
  const double rise =
      at(wall->distance_mm, {0.0, 17.0, 0.0}) - at(wall->distance_mm, {0.0, 19.0, 0.0});
  EXPECT_NEAR(rise, 2.0, 1.0);
}

TEST(DerivedWall, OfSmallDataIsThatOfLargeOnes) {
  // A mouse's heart: the same samples at a tenth of the size.
  const Volume large = spotted_ball();
  Volume small = large;
  small.grid.spacing_mm *= 0.1;
  small.grid.origin_mm *= 0.1;
  EXPECT_NEAR(wall_scale(large.grid), 0.64, 1e-9);
  EXPECT_NEAR(wall_scale(small.grid), 0.064, 1e-9);
  EXPECT_NEAR(wall_of(small).ends, wall_of(large).ends, 1e-3);
  const auto of_large = region_wall(large, 0.0), of_small = region_wall(small, 0.0);
  ASSERT_TRUE(of_large && of_small);
  EXPECT_NEAR(of_small->smooth_mm, 0.1 * of_large->smooth_mm, 1e-9);
  EXPECT_NEAR(of_small->ends, of_large->ends, 0.01);
  EXPECT_NEAR(at(of_small->distance_mm, {0.0, 0.0, 1.0}),
              0.1 * at(of_large->distance_mm, {0.0, 0.0, 10.0}), 1e-3);
  const auto ridges_of_large = ridge_wall(large, 0.0, {}, 1.0),
             ridges = ridge_wall(small, 0.0, {}, 0.1);
  ASSERT_TRUE(ridges_of_large && ridges);
  EXPECT_NEAR(at(ridges->distance_mm, {0.0, 1.7, 0.0}),
              0.1 * at(ridges_of_large->distance_mm, {0.0, 17.0, 0.0}), 1e-3);
  Grid body;
  body.size = glm::ivec3(200);
  EXPECT_EQ(wall_scale(body), 1.0);
}

TEST(DerivedWall, NothingIsMadeOfNothing) {
  const Volume flat = test::frame_of([](glm::dvec3) { return 7.0; });
  EXPECT_FALSE(region_wall(flat, 0.0));
  EXPECT_FALSE(ridge_wall(flat, 0.0));
  const Volume crumb =
      test::frame_of([](glm::dvec3 x) { return 1000.0 * edge(2.0 - glm::length(x)); });
  EXPECT_FALSE(region_wall(crumb, 0.0));
  EXPECT_FALSE(region_wall(crumb, 0.0, 5000.0));
}

TEST(DerivedWall, RegionIsAWallOnRealDataWhoseValuesAreNone) {
  const std::filesystem::path shared = PALPATE_SHARED_DATA;
  int looked = 0;
  for (const char* file :
       {"kit/headmr_waves/fixed.mha", "kit/spineus_breathing/fixed.mha",
        "kit/thoraxmr_heart/fixed.mha", "heart_cine/frame_00.mha", "heart_cine/frame_10.mha"}) {
    if (!std::filesystem::exists(shared / file)) continue;
    SCOPED_TRACE(file);
    ++looked;
    const auto frame = files::read_volume(shared / file);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_GT(wall_of(*frame).ends, kClosedWall);
    const auto wall = region_wall(*frame, kHalf_mm);
    ASSERT_TRUE(wall);
    EXPECT_LT(wall->ends, 0.1);
  }
  if (!looked) GTEST_SKIP() << "There are no real data in " << shared;
}

}  // namespace
}  // namespace palpate
