// Soft tissue behind a wall. Oracle: the closed form of a spring in series with the tissue. No tick
// may change the force by more than the limit for a release.
#include <gtest/gtest.h>

#include "tests/haptics/guard/force_steps.h"
#include "tests/haptics/shell_scene.h"

namespace palpate {
namespace {

using namespace test;

constexpr double kSoft_n_per_m = 250.0;
// Of the hand; its motion alone changes the force by 0.018 N per ms.
constexpr double kTissueSpeed_m_per_s = 0.03;
constexpr double kTissueMost_n_per_ms = 0.05;

/// 1 mm samples of 64 x 64 x 40 mm around the origin of volume space.
template <class Value>
std::shared_ptr<const FrameData> sampled(const Value& value) {
  Volume volume;
  volume.grid.size = {64, 64, 40};
  volume.grid.origin_mm = -0.5 * glm::dvec3(volume.grid.size - 1);
  for (int k = 0; k < volume.grid.size.z; ++k)
    for (int j = 0; j < volume.grid.size.y; ++j)
      for (int i = 0; i < volume.grid.size.x; ++i)
        volume.values.push_back(
            float(value(volume_from_lps(volume.grid.lps_from_index({i, j, k})))));
  return sampled_scalar(std::move(volume));
}

/// Solid below y = 0, with a hole of 5 mm radius 6 mm to the side; the tissue has no hole.
std::shared_ptr<const MovingVolume> holed_wall() {
  auto volume = std::make_shared<MovingVolume>();
  volume->name = "shell";
  volume->times.times_s = {0.0};
  volume->frames = {sampled([](glm::dvec3 x) {
    const double to_wall_mm = -1e3 * x.y;
    const double to_hole_mm = 1e3 * glm::length(glm::dvec2(x.x - 0.006, x.z)) - 5.0;
    return 1000.0 * std::clamp(0.5 + std::min(to_wall_mm, to_hole_mm), 0.0, 1.0);
  })};
  volume->segments = {
      {"tissue", glm::vec3(1.0F), {sampled([](glm::dvec3 x) { return -1e3 * x.y; })}}};
  return volume;
}

SceneSpec scene(bool wall) {
  SceneSpec spec = shell_spec(6.0, 0.0, 600.0);
  ModeSpec tissue = spec.modes[0];
  spec.modes[0].strength = *TransferFunction::window(500.0, 200.0, 6.0);
  tissue.name = tissue.kind = "tissue";
  tissue.segment = "tissue";
  tissue.strength = *TransferFunction::linear({0.0, 16.0}, {0.0, 16e-3 * kSoft_n_per_m});
  if (!wall) spec.modes.clear();
  spec.modes.push_back(tissue);
  return spec;
}

/// The spring's force on a hand at this depth in the tissue: k (d - x) = c x.
double expected_n(double deep_m) {
  return deep_m / (1.0 / 600.0 + 1.0 / kSoft_n_per_m);
}

class Walk {
 public:
  Walk(Hand& hand, glm::dvec3 start) : hand_(hand), probe_(start) {
    for (int wait = 0; wait < 2500; ++wait) steps.add(hand_.to(probe_));
  }
  void go(glm::dvec3 to) {
    while (probe_ != to) {
      const glm::dvec3 way = to - probe_;
      const double step = 1e-3 * kTissueSpeed_m_per_s;
      probe_ = glm::length(way) > step ? probe_ + way * (step / glm::length(way)) : to;
      steps.add(hand_.to(probe_));
    }
  }
  void rest() {
    for (int tick = 0; tick < 1000; ++tick) steps.add(hand_.to(probe_));
  }
  ForceSteps steps;

 private:
  Hand& hand_;
  glm::dvec3 probe_;
};

TEST(Tissue, HoldsAHandThatComesThroughAHoleInAWall) {
  for (const bool metered : {true, false}) {
    HapticsOptions options;
    options.meter_energy = metered;
    options.lead = false;
    Hand hand(scene(true), {holed_wall()}, options);
    Walk walk(hand, {-0.008, 0.005, 0.0});
    walk.go({-0.008, -0.003, 0.0});
    // On the wall the tissue is not felt: the proxy is not in it.
    EXPECT_NEAR(walk.steps.last_n().y, 1.8, 0.1);
    walk.go({0.006, -0.003, 0.0});
    walk.rest();
    EXPECT_NEAR(walk.steps.last_n().y, expected_n(0.003), 0.02);
    EXPECT_LE(walk.steps.worst_n(), kTissueMost_n_per_ms);
  }
}

TEST(Tissue, GrowsWithTheDepthWithoutASurface) {
  Hand hand(scene(false), {holed_wall()}, unmetered());
  Walk walk(hand, {0.0, 0.002, 0.0});
  EXPECT_EQ(glm::length(walk.steps.last_n()), 0.0);
  for (const double deep_m : {0.001, 0.002, 0.004, 0.008}) {
    walk.go({0.0, -deep_m, 0.0});
    walk.rest();
    EXPECT_NEAR(walk.steps.last_n().y, expected_n(deep_m), 0.01) << deep_m;
  }
  // No larger steps than the hand's own speed gives.
  EXPECT_LE(walk.steps.worst_n(), 1e-3 * kTissueSpeed_m_per_s * 600.0);
}

TEST(Tissue, IsRefusedWithoutASlope) {
  SceneSpec spec = scene(false);
  spec.modes[0].gain = 0.0;
  const auto refused = plan(spec, {holed_wall()});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("gain"), std::string::npos);
}

}  // namespace
}  // namespace palpate
