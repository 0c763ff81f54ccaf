// Walls of segments: their stiffness, and the force behind them. Oracle: two springs in series.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "compute/volume/signed_distance.h"
#include "module/scene/segment_modes.h"
#include "tests/haptics/guard/force_steps.h"
#include "tests/haptics/shell_scene.h"

namespace palpate {
namespace {

using namespace test;
using ::testing::HasSubstr;

constexpr double kSpring = 600.0;  // N/m, of the scene
// By then the guards' start ramp has ended.
constexpr double kWallStart_s = 2.5;

/// A slab from z = 0 down to -thick_mm of volume space, far wider than the hand's way along x and
/// y, as a segment of a volume whose values are not used.
std::shared_ptr<const MovingVolume> slab(double thick_mm) {
  Mask mask;
  mask.grid.size = {60, 60, 60};
  // Volume space's z is -y of the patient; z = 0 is in the middle between two samples.
  mask.grid.origin_mm = {-29.5, -9.5, -29.5};
  mask.values.resize(mask.grid.count());
  for (int k = 0; k < 60; ++k)
    for (int j = 0; j < 60; ++j)
      for (int i = 0; i < 60; ++i) {
        const double z_mm = 1e3 * volume_from_lps(mask.grid.lps_from_index({i, j, k})).z;
        mask.values[mask.grid.offset(i, j, k)] = z_mm < 0.0 && z_mm > -thick_mm;
      }
  auto volume = std::make_shared<MovingVolume>();
  volume->name = "slab";
  volume->times.times_s = {0.0};
  volume->frames = {
      sampled_scalar(Volume{mask.grid, std::vector<float>(mask.grid.count(), 100.0F)})};
  volume->segments = {{"wall", glm::vec3(1.0F), {sampled_scalar(signed_distance(mask))}}};
  return volume;
}

SceneSpec slab_scene(const SegmentSpec& wall, double scale = 1.0) {
  SceneSpec spec;
  spec.volumes.resize(1);
  spec.volumes[0].name = "slab";
  spec.volumes[0].transform.scale = glm::dvec3(scale);
  spec.volumes[0].segments.parts = {wall};
  spec.stiffness_n_per_m = kSpring;
  return spec;
}

SegmentSpec a_wall(double strength_n, double stiffness_n_per_m) {
  SegmentSpec wall;
  wall.name = "wall";
  wall.strength_n = strength_n;
  wall.stiffness_n_per_m = stiffness_n_per_m;
  wall.friction = 0.0;
  return wall;
}

/// z of the force after the hand has come to rest at a depth.
double pressed_n(Hand& hand, double& at_m, double depth_m) {
  TickOutput out;
  while (at_m > -depth_m) out = hand.to({0.0, 0.0, at_m = std::max(at_m - 1e-5, -depth_m)});
  for (int rest = 0; rest < 500; ++rest) out = hand.to({0.0, 0.0, at_m});
  return out.wanted_n.z;
}

TEST(SegmentWall, IsASpringInSeriesWithTheScenes) {
  const auto volume = slab(25.0);
  for (const double scale : {1.0, 0.5})
    for (const double stiffness : {300.0, 600.0, 4000.0}) {
      Hand hand(slab_scene(a_wall(2.0, stiffness), scale), {volume});
      double at_m = 0.003;
      for (int wait = 0; wait < int(1e3 * kWallStart_s); ++wait) hand.to({0.0, 0.0, at_m});
      EXPECT_EQ(hand.to({0.0, 0.0, at_m}).wanted_n, glm::dvec3(0.0)) << "nothing before the wall";
      const double both = kSpring * stiffness / (kSpring + stiffness);
      for (const double depth_m : {0.5e-3, 1e-3, 2e-3, 3e-3}) {
        const double wanted = std::min(2.0, both * depth_m);
        // The Gaussian does not move a plane; contact is found to 0.2 um, the proxy to within a
        // few.
        EXPECT_NEAR(pressed_n(hand, at_m, depth_m), wanted, 0.01 + 0.01 * wanted)
            << stiffness << " N/m at " << depth_m << " m, scale " << scale;
      }
    }
}

TEST(SegmentWall, ResistsAsTissueBehindItsSurface) {
  Hand hand(slab_scene(a_wall(1.5, 1000.0)), {slab(25.0)});
  double at_m = 0.003;
  for (int wait = 0; wait < int(1e3 * kWallStart_s); ++wait) hand.to({0.0, 0.0, at_m});
  // Through the surface at 1.5 N, and further through the slab.
  for (const double depth_m : {5e-3, 8e-3, 11e-3})
    EXPECT_NEAR(pressed_n(hand, at_m, depth_m), 1.5, 0.02) << depth_m;
}

/// The largest force of a slab from z = 0 down to -thick_mm that is pressed until it gives way,
/// from above (side 1) or from below (-1).
double most_n(const SceneSpec& spec, const std::shared_ptr<const MovingVolume>& volume,
              double thick_mm, double side) {
  Hand hand(spec, {volume});
  const double scale = spec.volumes[0].transform.scale.x;
  const double border_m = side > 0.0 ? 0.0 : -1e-3 * thick_mm * scale;
  double above_m = 0.003, most = 0.0;
  const auto force_n = [&] {
    return side * hand.to({0.0, 0.0, border_m + side * above_m}).wanted_n.z;
  };
  for (int wait = 0; wait < int(1e3 * kWallStart_s); ++wait) force_n();
  for (double now = 0.0; above_m > -0.012 && (most < 0.1 || now > 0.5 * most); above_m -= 1e-5) {
    now = force_n();
    most = std::max(most, now);
  }
  return most;
}

TEST(SegmentWall, HoldsWhatIsSaidOfItFromBothSides) {
  for (const double thick_mm : {1.0, 2.0, 3.0, 4.0}) {
    const auto volume = slab(thick_mm);
    const FrameData& distance = *volume->segments[0].distance_mm[0];
    SegmentSpec wall = a_wall(4.0, 4000.0);
    const SceneSpec usual = slab_scene(wall, 0.5);
    const double said_n = wall_hold(distance, wall, 0.5).force_n;
    EXPECT_LT(said_n, 4.0) << thick_mm;
    for (const double side : {1.0, -1.0}) {
      const double held_n = most_n(usual, volume, thick_mm, side);
      EXPECT_LT(said_n, 0.02 + 1.02 * held_n) << thick_mm << " mm from " << side;
      // A tenth of the places is along the slab's rim, which is weaker.
      EXPECT_GT(said_n, 0.75 * held_n) << thick_mm << " mm from " << side;
    }
    // From two voxels on a stiffer wall holds all of it.
    wall.stiffness_n_per_m = holding_stiffness(distance, wall, 0.5);
    EXPECT_GT(wall.stiffness_n_per_m, 4000.0);
    for (const double side : {1.0, -1.0})
      EXPECT_GT(most_n(slab_scene(wall, 0.5), volume, thick_mm, side), thick_mm < 2.0 ? 0.5 : 3.8)
          << thick_mm << " mm from " << side;
  }
}

TEST(SegmentWall, HoldsWhereItIsThinnerThanAVoxel) {
  // An oblique sheet through the origin: of the voxels of 1.4 mm those whose centres are within 0.3
  // voxels of its plane.
  for (const glm::dvec3 across : {glm::dvec3(0, 0, 1), glm::dvec3(0.2, -0.6, 1), glm::dvec3(1)}) {
    const glm::dvec3 n = glm::normalize(across);
    Mask mask;
    mask.grid.size = {40, 40, 40};
    mask.grid.spacing_mm = glm::dvec3(1.4);
    mask.grid.origin_mm = glm::dvec3(-19.5 * 1.4);
    mask.values.resize(mask.grid.count());
    for (int k = 0; k < 40; ++k)
      for (int j = 0; j < 40; ++j)
        for (int i = 0; i < 40; ++i) {
          const glm::dvec3 x = volume_from_lps(mask.grid.lps_from_index({i, j, k}));
          mask.values[mask.grid.offset(i, j, k)] =
              std::abs(glm::dot(n, x) - 5e-4) < 0.3 * 1.4e-3 && glm::length(x) < 0.023;
        }
    MovingVolume volume = *slab(10.0);
    const auto distance = sampled_scalar(signed_distance(mask));
    volume.segments[0].distance_mm = {distance};
    SegmentSpec wall = a_wall(4.0, 4000.0);
    wall.stiffness_n_per_m = holding_stiffness(*distance, wall, 0.5);
    for (const double side : {1.0, -1.0}) {
      Hand hand(slab_scene(wall, 0.5), {std::make_shared<const MovingVolume>(volume)});
      double above_m = 0.004, most_n = 0.0, now_n = 0.0;
      const auto press = [&] {
        now_n = side * glm::dot(n, hand.to(n * (2.5e-4 + side * above_m)).wanted_n);
      };
      for (int wait = 0; wait < int(1e3 * kWallStart_s); ++wait) press();
      for (; above_m > -0.012 && (most_n < 0.1 || now_n > 0.5 * most_n); above_m -= 1e-5) {
        press();
        most_n = std::max(most_n, now_n);
      }
      EXPECT_GT(most_n, 3.5) << n.x << " " << n.y << " " << n.z << " from " << side;
    }
  }
}

TEST(SegmentWall, LetsTheHandThroughAndOutWithoutAJump) {
  for (const double strength_n : {1.5, 3.0})
    for (const bool metered : {true, false}) {
      HapticsOptions options;
      options.meter_energy = metered;
      Hand hand(slab_scene(a_wall(strength_n, 2000.0)), {slab(10.0)}, options);
      ForceSteps steps;
      double most_n = 0.0;
      glm::dvec3 probe(0.0, 0.0, 0.003);
      for (int wait = 0; wait < int(1e3 * kWallStart_s); ++wait) steps.add(hand.to(probe));
      // 0.03 m/s alone give 0.018 N per ms: in, through, out behind, and back again.
      for (const double to : {-0.022, 0.012})
        while (probe.z != to) {
          probe.z = to < probe.z ? std::max(to, probe.z - 3e-5) : std::min(to, probe.z + 3e-5);
          const TickOutput out = hand.to(probe);
          steps.add(out);
          most_n = std::max(most_n, glm::length(out.wanted_n));
        }
      for (int rest = 0; rest < 500; ++rest) steps.add(hand.to(probe));
      EXPECT_GT(most_n, 0.9 * strength_n) << "it held";
      EXPECT_LE(steps.worst_n(), 0.05) << strength_n << " N";
      EXPECT_LT(glm::length(steps.last_n()), 1e-6) << "and is left";
    }
}

TEST(SegmentWall, IsAModeOfItsOwnUnlessAWrittenOneReadsIt) {
  SceneSpec spec = slab_scene(a_wall(2.0, 500.0), 0.5);
  std::vector<ModeSpec> modes = modes_of(spec);
  ASSERT_EQ(modes.size(), 1U);
  EXPECT_EQ(modes[0].name, "wall");
  EXPECT_EQ(modes[0].segment, "wall");
  // 2 N at 500 N/m are 4 mm of the world, which are 8 mm of the data.
  EXPECT_DOUBLE_EQ(modes[0].strength(4.0), 1.0);
  EXPECT_DOUBLE_EQ(modes[0].strength(20.0), 2.0);
  EXPECT_EQ(modes[0].strength(-0.1), 0.0);
  ModeSpec written;
  written.name = written.segment = "wall";
  written.volume = "slab";
  written.strength = TransferFunction::constant(1.0);
  spec.modes = {written};
  EXPECT_EQ(modes_of(spec).size(), 1U);
  spec.modes[0].segment.clear();
  modes = modes_of(spec);
  ASSERT_EQ(modes.size(), 2U);
  EXPECT_EQ(modes[1].name, "slab: wall");
  spec.modes.clear();
  spec.volumes[0].segments.parts[0].felt = false;
  EXPECT_TRUE(modes_of(spec).empty());
}

TEST(SegmentWall, IsNotFeltInFramesWhereItIsNotKnown) {
  MovingVolume two = *slab(10.0);
  two.frames.push_back(two.frames[0]);
  two.times.times_s = {0.0, 1.0};
  const auto assembled =
      plan(slab_scene(a_wall(2.0, 500.0)), {std::make_shared<const MovingVolume>(std::move(two))});
  ASSERT_FALSE(assembled);
  EXPECT_THAT(assembled.error().message, HasSubstr("which is only known in frame 0"));
}

}  // namespace
}  // namespace palpate
