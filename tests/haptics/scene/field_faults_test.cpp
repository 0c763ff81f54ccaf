// Motion fields that fold or have no confidence, under a hand that holds still: where the point is
// not determined, it is flagged and frozen and the force fades; the proxy never jumps. Oracle: the
// motion itself, x + g u(x).
#include <gtest/gtest.h>

#include "tests/haptics/guard/force_steps.h"
#include "tests/haptics/shell_scene.h"
#include "tests/support/random.h"

namespace palpate {
namespace {

using namespace test;

constexpr double kStiffness = 600.0;
// N per ms: the required limit.
constexpr double kFadeStep_n = 0.05;

/// A ball of constant shape in frames whose motion is given (m, volume space), one frame per
/// second.
std::shared_ptr<MovingVolume> ball(
    const std::vector<std::function<glm::dvec3(glm::dvec3)>>& motions) {
  auto volume = std::make_shared<MovingVolume>();
  volume->name = "shell";
  Motion motion{"data", {}};
  const Grid grid = shell_grid(2.0);
  for (size_t k = 0; k <= motions.size(); ++k) {
    volume->frames.push_back(std::make_shared<Ball>(0.025, 1.06e-3));
    volume->times.times_s.push_back(double(k));
    if (k == motions.size()) continue;
    Field field{grid, std::vector<glm::vec3>(grid.count())};
    for (int z = 0; z < grid.size.z; ++z)
      for (int y = 0; y < grid.size.y; ++y)
        for (int x = 0; x < grid.size.x; ++x) {
          const glm::dvec3 at = volume_from_lps(grid.lps_from_index({x, y, z}));
          field.u_mm[grid.offset(x, y, z)] = glm::vec3(lps_from_volume(motions[k](at)));
        }
    motion.steps.push_back(MotionMap::of(field));
  }
  volume->motions = {motion};
  return volume;
}

glm::dvec3 still(glm::dvec3) {
  return glm::dvec3(0.0);
}

/// Folds around y = 0, sampled at 2 mm, from a phase of 0.567 on: the material is compressed there.
glm::dvec3 folding(glm::dvec3 x) {
  constexpr double kWave_m = 0.01, kReach_m = 0.003;
  return {0.0, -kReach_m * std::sin(2.0 * std::numbers::pi * x.y / kWave_m), 0.0};
}

TEST(FoldedField, IsHeldFadedFlaggedAndRecoveredFrom) {
  Hand hand(shell_spec(20.0, 0.2, kStiffness), {ball({still, still, still, folding, still})});
  // After the start gate's ramp, so that the reported cause is the scene's.
  for (int i = 0; i < 2200; ++i) hand.to({0.03, 0.0, 0.0});
  for (int i = 0; i < 300; ++i) hand.to({0.03 - 0.008 * i / 300.0, 0.0, 0.0});
  const glm::dvec3 at(0.022, 0.0, 0.0);
  ForceSteps steps;
  int held = 0, first_held = -1, gone = -1;
  Cause cause = Cause::kNone;
  for (int i = 2500; i < 4000; ++i) {
    const TickOutput out = hand.to(at);
    steps.add(out);
    const double g = out.first.phase;
    if (out.first.frame != 3 || !(g > 0.568)) continue;
    EXPECT_TRUE(out.frozen) << "tick " << i << ": the fold is not flagged";
    held += out.frozen;
    if (first_held < 0) first_held = i;
    if (gone < 0 && glm::length(out.wanted_n) < 1e-3) gone = i;
    cause = out.cause;
  }
  EXPECT_GT(held, 400);
  ASSERT_GT(gone, 0) << "the force does not fade";
  // The fall from 1.8 N at 50 N/s, and some ticks between the true fold and the phase that is
  // tested.
  EXPECT_LT(gone - first_held, 60);
  EXPECT_EQ(cause, Cause::kField);
  for (int i = 4000; i < 4500; ++i) steps.add(hand.to(at));
  std::printf("folded field: worst step %.4f N per ms, gone after %d ms\n", steps.worst_n(),
              gone - first_held);
  EXPECT_LE(steps.worst_n(), kFadeStep_n + 1e-9);
  // Out and in again: contact is as before.
  for (int i = 0; i < 300; ++i) hand.to({0.022 + 0.008 * i / 300.0, 0.0, 0.0});
  TickOutput out;
  for (int i = 0; i < 300; ++i) out = hand.to({0.03 - 0.008 * i / 300.0, 0.0, 0.0});
  EXPECT_FALSE(out.frozen);
  EXPECT_NEAR(out.wanted_n.x, kStiffness * (0.025 - out.probe_m.x), 0.01);
}

/// Three random waves, each of up to 3 mm: q is far above 1 in some places.
std::function<glm::dvec3(glm::dvec3)> rough(test::Random& random) {
  struct Wave {
    glm::dvec3 reach, number;
    double phase;
  };
  std::array<Wave, 3> waves;
  for (Wave& wave : waves) {
    wave.reach = random.vector(0.003);
    wave.number = random.vector(2.0 * std::numbers::pi / 0.012);
    wave.phase = random.draw(0.0, 6.3);
  }
  return [waves](glm::dvec3 x) {
    glm::dvec3 u(0.0);
    for (const Wave& wave : waves)
      u += wave.reach * std::sin(glm::dot(wave.number, x) + wave.phase);
    return u;
  };
}

TEST(RoughFields, NeverMoveThePointUnflaggedNorJumpTheForce) {
  int held_runs = 0;
  double worst = 0.0;
  for (uint32_t seed = 1; seed <= 30; ++seed) {
    test::Random random(seed);
    const auto data = ball({rough(random), rough(random), rough(random)});
    ASSERT_GT(data->motions[0].steps[0]->worst_contraction(), 1.0F);
    Hand hand(shell_spec(20.0, random.draw(0.0, 1.0), kStiffness), {data});
    glm::dvec3 way = random.vector(1.0);
    way = glm::normalize(way);
    for (int i = 0; i < 50; ++i) hand.to(way * (0.03 - 0.006 * i / 50.0));
    ForceSteps steps;
    bool held = false;
    for (int i = 50; i < 3300; ++i) {
      const TickOutput out = hand.to(0.024 * way);
      steps.add(out);
      ASSERT_TRUE(std::isfinite(glm::length(out.wanted_n))) << "seed " << seed << " tick " << i;
      held |= out.frozen;
      if (out.frozen || out.first.frame == 3) continue;
      // The motion is not cyclic, so no closing term is added: the position is x + g u(x).
      const glm::dvec3 x = hand.haptics.run()->points[0].carriers[0].carrier->material();
      const MotionMap& map = *data->motions[0].steps[size_t(out.first.frame)];
      const double miss =
          glm::length(x + out.first.phase * map.displacement(x) - out.proxy_m) / map.cell_m();
      ASSERT_LE(miss, 1e-3) << "seed " << seed << " tick " << i << ": not frozen, but off";
    }
    held_runs += held;
    worst = std::max(worst, steps.worst_n());
    EXPECT_LE(steps.worst_n(), kFadeStep_n + 1e-9) << "seed " << seed;
  }
  std::printf("rough fields: %d of 30 runs held, worst step %.4f N per ms\n", held_runs, worst);
  EXPECT_GE(held_runs, 5) << "the fields must fold under the hand for this test to check anything";
}

TEST(LowConfidence, FadesTheForceAndSaysSo) {
  auto data = ball({still, still, still, still, still, still});
  Grid grid = shell_grid(8.0);
  Confidence confidence{grid, std::vector<float>(grid.count())};
  for (int z = 0; z < grid.size.z; ++z)
    for (int y = 0; y < grid.size.y; ++y)
      for (int x = 0; x < grid.size.x; ++x) {
        // Confidence 1 in front of the ball, 0 at its side.
        const glm::dvec3 at = volume_from_lps(grid.lps_from_index({x, y, z}));
        confidence.values[grid.offset(x, y, z)] = float(std::clamp(1.0 - at.y / 0.02, 0.0, 1.0));
      }
  const Field field{shell_grid(2.0), std::vector<glm::vec3>(shell_grid(2.0).count())};
  for (auto& step : data->motions[0].steps) step = MotionMap::of(field, &confidence);
  Hand hand(shell_spec(5.0, 0.0, kStiffness), {data});
  for (int i = 0; i < 2200; ++i) hand.to({0.03, 0.0, 0.0});
  for (int i = 0; i < 300; ++i) hand.to({0.03 - 0.008 * i / 300.0, 0.0, 0.0});
  ForceSteps steps;
  bool told = false;
  double before = 0.0, after = 1.0;
  for (int i = 0; i < 3000; ++i) {
    // Around the ball at 10 mm/s, from the side with confidence to the other.
    const double angle = 0.01 * 1e-3 * i / 0.022;
    const TickOutput out = hand.to(0.022 * glm::dvec3(std::cos(angle), std::sin(angle), 0.0));
    steps.add(out);
    told |= out.cause == Cause::kConfidence;
    if (i == 300) before = glm::length(out.wanted_n);
    after = glm::length(out.wanted_n);
  }
  std::printf("low confidence: worst step %.4f N per ms\n", steps.worst_n());
  EXPECT_NEAR(before, kStiffness * 0.003, 0.01);
  EXPECT_EQ(after, 0.0);
  EXPECT_TRUE(told);
  EXPECT_LE(steps.worst_n(), kFadeStep_n);
}

}  // namespace
}  // namespace palpate
