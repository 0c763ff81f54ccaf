// What the walls of segments hold. Oracle: plates and balls whose thickness is known.
#include "module/scene/segment_modes.h"

#include <gtest/gtest.h>

#include "tests/scene/ball_frames.h"

namespace palpate {
namespace {

constexpr double kSpring = 600.0;

TEST(SegmentModes, AWallHoldsWhatItsThicknessAllows) {
  SegmentSpec segment;  // 4 N, 4000 N/m
  // The spline by which distances are read rounds the ridge in the middle by a third of a voxel.
  const auto plate_of = [](double half_mm) {
    return sampled_scalar(test::frame_of(
        [=](glm::dvec3 x) { return half_mm - std::abs(x.z - 0.25); }, glm::dvec3(0.5)));
  };
  // In series: 4000 * 600 / 4600 N/m over the whole thickness.
  for (const double scale : {1.0, 0.5}) {
    const WallHold thin = wall_hold(*plate_of(3.0), segment, kSpring, scale);
    EXPECT_NEAR(thin.thickness_m, 0.006 * scale, 0.0005 * scale) << scale;
    EXPECT_NEAR(thin.force_n, 0.006 * scale * 521.7, 0.26 * scale) << scale;
  }
  const WallHold thick = wall_hold(*plate_of(12.0), segment, kSpring, 1.0);
  EXPECT_EQ(thick.force_n, 4.0);
  // A wall that yields is no stronger than the strength at its middle.
  segment.stiffness_n_per_m = 100.0;
  EXPECT_NEAR(wall_hold(*plate_of(3.0), segment, 1e6, 1.0).force_n, 0.3, 0.03);
  const auto nothing = sampled_scalar(test::frame_of([](glm::dvec3) { return -9.0; }));
  EXPECT_EQ(wall_hold(*nothing, segment, kSpring, 1.0).force_n, 0.0);
}

TEST(SegmentModes, ItsThinPlacesCount) {
  // Two plates beside each other, of 24 and of 4 mm; a fifth of the places is thin.
  const auto step = sampled_scalar(
      test::frame_of([](glm::dvec3 x) { return (x.x < 19.0 ? 12.0 : 2.0) - std::abs(x.z - 0.5); }));
  EXPECT_NEAR(wall_hold(*step, SegmentSpec(), kSpring, 1.0).force_n, 2.1, 0.4);
}

TEST(SegmentModes, HalfOfTheThicknessThatAHandNeeds) {
  // 5 mm of the hand and 0.75 mm of the proxy, shown at half its size.
  EXPECT_NEAR(half_thickness_mm(3.0, 600.0, 4000.0, 0.5), 5.75, 1e-12);
}

}  // namespace
}  // namespace palpate
