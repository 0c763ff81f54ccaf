// A contact ends: over the edge of a wall, at a hole in it, at the border of the data, or because
// the values change. There is no oracle: no tick may change the force by more than the limit for a
// release, however the wall ends.
#include <gtest/gtest.h>

#include <functional>

#include "tests/haptics/guard/force_steps.h"
#include "tests/haptics/shell_scene.h"

namespace palpate {
namespace {

using namespace test;

constexpr double kMost_n_per_ms = 0.05;
// Of the hand; its motion alone changes the force by 0.018 N per ms.
constexpr double kSpeed_m_per_s = 0.03;
// Depth of the hand: 1.8 N.
constexpr double kDeep_m = 3e-3;
// By then the guards' start ramp has ended.
constexpr double kStart_s = 2.5;
constexpr double kLater_s = 3.2;  // the hand presses by then

/// 1 mm samples, 64 x 64 x 40 mm around the origin of volume space, from a formula in volume space.
Volume sampled(const std::function<bool(glm::dvec3)>& is_solid) {
  Volume volume;
  volume.grid.size = {64, 64, 40};
  volume.grid.origin_mm = -0.5 * glm::dvec3(volume.grid.size - 1);
  volume.values.resize(volume.grid.count());
  for (int k = 0; k < volume.grid.size.z; ++k)
    for (int j = 0; j < volume.grid.size.y; ++j)
      for (int i = 0; i < volume.grid.size.x; ++i) {
        // The share of the sample's own volume that is solid: edges are one sample wide.
        double share = 0.0;
        for (int c = 0; c < 64; ++c) {
          const glm::dvec3 part = (glm::dvec3(c & 3, c >> 2 & 3, c >> 4) - 1.5) * 0.25;
          share +=
              is_solid(volume_from_lps(volume.grid.lps_from_index(glm::dvec3(i, j, k) + part))) /
              64.0;
        }
        volume.values[volume.grid.offset(i, j, k)] = float(1000.0 * share);
      }
  return volume;
}

struct Case {
  const char* name;
  /// In the frame at the start, volume space, m.
  std::function<bool(glm::dvec3)> is_solid;
  /// From kLater_s on; null: as at the start.
  std::function<bool(glm::dvec3)> is_solid_later;
  /// How far the hand slides along x.
  double way_m;
};

/// A wall below z = 0.
bool below(glm::dvec3 x) {
  return x.z < 0.0;
}

class EndOfAWall : public ::testing::TestWithParam<Case> {};

TEST_P(EndOfAWall, FadesTheForceAndSaysSo) {
  const Case& of = GetParam();
  auto volume = std::make_shared<MovingVolume>();
  volume->name = "wall";
  volume->frames = {sampled_scalar(sampled(of.is_solid))};
  volume->times.times_s = {0.0};
  for (const double later_s : {kLater_s, 2.0 * kLater_s}) {
    if (!of.is_solid_later) break;
    volume->frames.push_back(sampled_scalar(sampled(of.is_solid_later)));
    volume->times.times_s.push_back(later_s);
  }
  SceneSpec spec = shell_spec(6.0, 0.1, 600.0);
  spec.volumes[0].name = spec.modes[0].volume = volume->name;
  spec.volumes[0].cyclic = spec.volumes[0].blend_values = false;
  spec.modes[0].strength = *TransferFunction::window(500.0, 200.0, 6.0);
  for (const bool metered : {true, false}) {
    HapticsOptions options;
    options.meter_energy = metered;
    Hand hand(spec, {volume}, options);
    ForceSteps steps;
    double most_n = 0.0;
    bool is_said = false;
    glm::dvec3 probe(-0.008, 0.0, 0.005);
    const auto go = [&](glm::dvec3 to) {
      while (probe != to) {
        const glm::dvec3 way = to - probe;
        const double step = 1e-3 * kSpeed_m_per_s;
        probe = glm::length(way) > step ? probe + way * (step / glm::length(way)) : to;
        const TickOutput out = hand.to(probe);
        steps.add(out);
        most_n = std::max(most_n, glm::length(out.wanted_n));
        is_said |= out.cause == Cause::kSudden;
      }
    };
    for (int wait = 0; wait < int(1e3 * kStart_s); ++wait) steps.add(hand.to(probe));
    go({-0.008, 0.0, -kDeep_m});
    go({-0.008 + of.way_m, 0.0, -kDeep_m});
    for (int rest = 0; rest < 1500; ++rest) {
      const TickOutput out = hand.to(probe);
      steps.add(out);
      is_said |= out.cause == Cause::kSudden;
    }
    EXPECT_GT(most_n, 1.5) << "the wall held";
    EXPECT_LT(glm::length(steps.last_n()), 1e-6) << "and is left";
    EXPECT_LE(steps.worst_n(), kMost_n_per_ms);
    EXPECT_TRUE(is_said);
  }
}

INSTANTIATE_TEST_SUITE_P(
    , EndOfAWall,
    ::testing::Values(
        Case{"Edge", [](glm::dvec3 x) { return below(x) && x.x < 0.004; }, nullptr, 0.025},
        Case{"ThinPlatesEdge", [](glm::dvec3 x) { return below(x) && x.z > -0.003 && x.x < 0.004; },
             nullptr, 0.025},
        Case{"Hole",
             [](glm::dvec3 x) {
               return below(x) && x.z > -0.004 &&
                      glm::length(glm::dvec2(x) - glm::dvec2(0.006, 0.0)) > 0.005;
             },
             nullptr, 0.014},
        Case{"ValuesThatGo", below, [](glm::dvec3) { return false; }, 0.002}),
    [](const auto& of) { return of.param.name; });

}  // namespace
}  // namespace palpate
