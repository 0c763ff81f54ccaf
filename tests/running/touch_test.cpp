// Where a simulated hand presses. Oracle: a block with a crack beside the place that is met first.
#include "integration/running/touch.h"

#include <gtest/gtest.h>

#include "module/scene/frame_data.h"
#include "tests/scene/ball_frames.h"

namespace palpate::running {
namespace {

constexpr double kHalf_mm = 15.0;

/// A cube of 30 mm around the origin; with a crack of 3 mm in its front (towards +z), from 2 mm
/// beside the middle on.
LoadedScene block(bool cracked) {
  const auto depth_mm = [cracked](glm::dvec3 lps_mm) {
    const glm::dvec3 x = 1e3 * volume_from_lps(lps_mm);
    const double cube = kHalf_mm - std::max({std::abs(x.x), std::abs(x.y), std::abs(x.z)});
    const double crack = std::min({1.5 - std::abs(x.x - 3.5), 14.0 - std::abs(x.y), x.z});
    return cracked ? std::min(cube, -crack) : cube;
  };
  const auto distance = sampled_scalar(test::frame_of(depth_mm));
  auto volume = std::make_shared<MovingVolume>();
  volume->name = "block";
  volume->times.times_s = {0.0};
  volume->frames = {sampled_scalar(test::frame_of([](glm::dvec3) { return 0.0; }))};
  volume->segments = {{"wall", glm::vec3(1.0F), {distance}}};
  LoadedScene scene;
  VolumeSpec& spec = scene.spec.volumes.emplace_back();
  spec.name = "block";
  spec.segments.parts.emplace_back().name = "wall";
  scene.data = {volume};
  return scene;
}

DeviceInfo reaching(double radius_m) {
  DeviceInfo device;
  device.workspace_radius_m = radius_m;
  return device;
}

TEST(PlaceToTouch, IsWhatAHandMeetsFirstIfItHolds) {
  const auto place = place_to_touch(block(false), reaching(0.035));
  ASSERT_TRUE(place);
  EXPECT_GT(place->outward.z, 0.99);
  EXPECT_NEAR(place->surface_m.z, 1e-3 * kHalf_mm, 5e-4);
}

TEST(PlaceToTouch, IsAnotherIfTheFirstHasACrackBesideIt) {
  const auto place = place_to_touch(block(true), reaching(0.035));
  ASSERT_TRUE(place);
  // From above only 1 mm covers the crack: the next is from the right.
  EXPECT_GT(place->outward.x, 0.99);
  EXPECT_NEAR(place->surface_m.x, 1e-3 * kHalf_mm, 5e-4);
}

}  // namespace
}  // namespace palpate::running
