// Sizes of segments in closed form: balls within one another, at rest and carried.
#include "module/session/segment_sizes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "module/scene/make_volume.h"

namespace palpate {
namespace {

constexpr double kCavity_mm = 14.0, kBody_mm = 22.0, kStretch = 0.2;

Grid lattice() {
  Grid grid;
  grid.size = glm::ivec3(37, 33, 29);
  grid.spacing_mm = {1.8, 2.0, 2.3};
  grid.origin_mm = -0.5 * grid.spacing_mm * glm::dvec3(grid.size - 1);
  return grid;
}

/// The distance to the surface of what has this radius around the origin, cut at a height: as a
/// ventricle's labels end at a slice.
std::shared_ptr<const FrameData> body(double radius_mm, double cut_mm) {
  Volume distance{lattice(), {}};
  for (int k = 0; k < distance.grid.size.z; ++k)
    for (int j = 0; j < distance.grid.size.y; ++j)
      for (int i = 0; i < distance.grid.size.x; ++i) {
        const glm::dvec3 x = distance.grid.lps_from_index({i, j, k});
        distance.values.push_back(float(std::min(radius_mm - glm::length(x), cut_mm - x.z)));
      }
  return sampled_scalar(std::move(distance));
}

/// A cavity and its wall, which is listed second, at two times; in the second both are smaller by
/// `less_mm`. is_body: the wall contains the cavity, as segments that are one body do.
MovingVolume heart(double less_mm, double cut_mm = 1e3) {
  MovingVolume volume;
  volume.times = {{0.0, 0.4}, 1.0};
  Volume values{lattice(), std::vector<float>(lattice().count())};
  volume.frames = {sampled_scalar(values), sampled_scalar(values)};
  volume.segments = {
      {"cavity", glm::vec3(1.0F), {body(kCavity_mm, cut_mm), body(kCavity_mm - less_mm, cut_mm)}},
      {"wall", glm::vec3(0.5F), {body(kBody_mm, cut_mm), body(kBody_mm, cut_mm)}}};
  return volume;
}

double ball_ml(double radius_mm) {
  return 4.0 / 3.0 * M_PI * std::pow(radius_mm, 3.0) * 1e-3;
}

TEST(SegmentSizes, AreThoseOfBallsWithinOneAnother) {
  const SegmentSizes sizes = segment_sizes(heart(3.0));
  ASSERT_EQ(sizes.cavity, 0);
  EXPECT_EQ(sizes.wall_mm.name, "wall");
  ASSERT_EQ(sizes.wall_mm.values.size(), 2U);
  for (size_t k = 0; k < 2; ++k) {
    const double radius_mm = k == 0 ? kCavity_mm : kCavity_mm - 3.0;
    EXPECT_NEAR(sizes.volumes_ml[0].values[k] / ball_ml(radius_mm), 1.0, 0.01) << k;
    // The wall's own volume: without the cavity.
    const double wall_ml = ball_ml(kBody_mm) - ball_ml(radius_mm);
    EXPECT_NEAR(sizes.volumes_ml[1].values[k] / wall_ml, 1.0, 0.01) << k;
    EXPECT_NEAR(sizes.wall_mm.values[k], kBody_mm - radius_mm, 0.1) << k;
  }
}

TEST(SegmentSizes, OfACutWallAreNotMeasuredAtTheCut) {
  const SegmentSizes sizes = segment_sizes(heart(3.0, 4.0));
  ASSERT_EQ(sizes.cavity, 0);
  EXPECT_NEAR(sizes.wall_mm.values[0], kBody_mm - kCavity_mm, 0.4);
  EXPECT_NEAR(sizes.wall_mm.values[1], kBody_mm - kCavity_mm + 3.0, 0.4);
}

TEST(SegmentSizes, AreCarriedByTheMotion) {
  // One frame's segments, and a motion that makes everything larger by a fifth.
  const Grid grid = lattice();
  SequenceMotion motion;
  motion.basis = {{0.0, 0.4}, 0.0, 0};
  Field larger{grid, {}};
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i)
        larger.u_mm.push_back(glm::vec3(kStretch * grid.lps_from_index({i, j, k})));
  motion.terms = {still_field(grid), larger};
  MovingVolume own = heart(0.0);
  own.times.cycle_s = 0.0;
  for (Segment& segment : own.segments) segment.distance_mm.resize(1);
  const auto volume = carried(own, motion);
  ASSERT_TRUE(volume) << volume.error().message;
  const SegmentSizes sizes = segment_sizes(*volume);
  ASSERT_EQ(sizes.cavity, 0);
  EXPECT_NEAR(sizes.volumes_ml[0].values[0] / ball_ml(kCavity_mm), 1.0, 0.01);
  EXPECT_NEAR(sizes.volumes_ml[0].values[1] / ball_ml(kCavity_mm * (1.0 + kStretch)), 1.0, 0.02);
  EXPECT_NEAR(sizes.wall_mm.values[0], kBody_mm - kCavity_mm, 0.1);
  EXPECT_NEAR(sizes.wall_mm.values[1], (1.0 + kStretch) * (kBody_mm - kCavity_mm), 0.2);
}

TEST(SegmentSizes, KnowNoWallOfPartsBesideEachOtherAndNoSizeOfAnotherFrame) {
  MovingVolume volume = heart(0.0);
  // A lower and an upper half.
  Volume lower{lattice(), {}}, upper{lattice(), {}};
  for (int k = 0; k < lower.grid.size.z; ++k)
    for (int n = 0; n < lower.grid.size.x * lower.grid.size.y; ++n) {
      const double z = lower.grid.lps_from_index({0, 0, k}).z;
      lower.values.push_back(float(std::min(-z, z + 10.0)));
      upper.values.push_back(float(std::min(z, 10.0 - z)));
    }
  volume.segments[0].distance_mm = {sampled_scalar(lower)};
  volume.segments[1].distance_mm = {sampled_scalar(upper)};
  volume.segments_frame = 1;
  const SegmentSizes sizes = segment_sizes(volume);
  EXPECT_EQ(sizes.cavity, -1);
  EXPECT_TRUE(sizes.wall_mm.values.empty());
  EXPECT_TRUE(std::isnan(sizes.volumes_ml[0].values[0]));
  EXPECT_GT(sizes.volumes_ml[0].values[1], 10.0);
}

}  // namespace
}  // namespace palpate
