// What the walls of segments hold. Oracle: plates and balls whose thickness is known.
#include "module/scene/segment_modes.h"

#include <gtest/gtest.h>

#include "tests/scene/ball_frames.h"

namespace palpate {
namespace {

/// A plate in voxels of half a millimetre, of this half thickness.
std::shared_ptr<const FrameData> plate_of(double half_mm) {
  return sampled_scalar(test::frame_of([=](glm::dvec3 x) { return half_mm - std::abs(x.z - 0.25); },
                                       glm::dvec3(0.5)));
}

TEST(SegmentModes, AWallHoldsWhatItsThicknessAllows) {
  SegmentSpec segment;  // 4 N, 4000 N/m
  // The strength in the middle, without the last tenth, where the ridge is round.
  for (const double scale : {0.2, 0.1}) {
    const WallHold thin = wall_hold(*plate_of(3.0), segment, scale);
    EXPECT_NEAR(thin.thickness_m, 0.006 * scale, 0.0005 * scale) << scale;
    EXPECT_NEAR(thin.force_n, 0.9 * 0.003 * scale * 4000.0, 0.05 * 0.003 * scale * 4000.0) << scale;
  }
  EXPECT_EQ(wall_hold(*plate_of(12.0), segment, 1.0).force_n, 4.0);
  const auto nothing = sampled_scalar(test::frame_of([](glm::dvec3) { return -9.0; }));
  EXPECT_EQ(wall_hold(*nothing, segment, 1.0).force_n, 0.0);
}

TEST(SegmentModes, ItsThinPlacesCount) {
  // Two plates beside each other, of 24 and of 4 mm; a fifth of the places is thin.
  const auto step = sampled_scalar(
      test::frame_of([](glm::dvec3 x) { return (x.x < 19.0 ? 12.0 : 2.0) - std::abs(x.z - 0.5); }));
  EXPECT_NEAR(wall_hold(*step, SegmentSpec(), 0.2).force_n, 0.8 * 2.0 * 0.2 * 4.0, 0.2);
}

TEST(SegmentModes, AThinWallIsAsStiffAsItsStrengthNeeds) {
  const SegmentSpec segment;  // 4 N, 4000 N/m
  EXPECT_EQ(holding_stiffness(*plate_of(12.0), segment, 1.0), 4000.0);
  // 2.1 N at 4000 N/m, so 4 N at twice that; and 1.1 N.
  EXPECT_EQ(holding_stiffness(*plate_of(3.0), segment, 0.2), 8000.0);
  EXPECT_EQ(holding_stiffness(*plate_of(3.0), segment, 0.1), 16000.0);
  EXPECT_EQ(holding_stiffness(*plate_of(3.0), segment, 0.001), 64000.0);
}

TEST(SegmentModes, HalfOfTheThicknessThatAHandNeeds) {
  // 5 mm of the hand and 0.75 mm of the proxy, shown at half its size.
  EXPECT_NEAR(half_thickness_mm(3.0, 600.0, 4000.0, 0.5), 5.75, 1e-12);
}

}  // namespace
}  // namespace palpate
