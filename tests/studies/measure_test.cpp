// Studies on small data: what they measure is what is there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "compute/volume/phantom.h"
#include "compute/vulkan/context.h"
#include "integration/studies/feel_runs.h"
#include "integration/studies/motion_study.h"

namespace palpate::studies {
namespace {

using testing::HasSubstr;

/// A peer that gives a known field in a known time.
class Fake final : public PairMethod {
 public:
  Fake(Field forward, Field backward)
      : forward_(std::move(forward)), backward_(std::move(backward)) {}
  Result<PairResult> run(const Volume& fixed, const Volume&) override {
    const bool there = first_ == nullptr || first_ == &fixed;
    first_ = first_ ? first_ : &fixed;
    return PairResult{there ? forward_ : backward_, 2.5};
  }
  std::string name() const override { return "fake"; }
  std::string family() const override { return "peers"; }

 private:
  const Volume* first_ = nullptr;
  Field forward_, backward_;
};

class Broken final : public PairMethod {
 public:
  Result<PairResult> run(const Volume&, const Volume&) override {
    return Error{ErrorKind::kBadInput, "it is broken."};
  }
  std::string name() const override { return "broken"; }
  std::string family() const override { return "peers"; }
};

TEST(MotionStudy, ScoresAPeerAgainstTheTruthAndItsWayBack) {
  const MotionCase heart = heart_case(32);
  const Grid& grid = heart.fixed.grid;
  std::vector<std::unique_ptr<PairMethod>> methods;
  methods.push_back(std::make_unique<Fake>(*heart.truth, heart_truth(grid, 1, 0)));
  methods.push_back(std::make_unique<Fake>(still_field(grid), still_field(grid)));
  methods.push_back(std::make_unique<Broken>());
  const MotionMeasures all = measure_motion({}, heart, std::move(methods));
  ASSERT_EQ(all.rows.size(), 2U);
  EXPECT_EQ(all.rows[0].error_mm, 0.0);
  EXPECT_EQ(all.rows[0].seconds, 2.5);
  EXPECT_EQ(all.rows[0].folded, 0U);
  // Sampled at 4 mm, the two true fields are not quite each other's inverse: trilinear between.
  EXPECT_LT(all.rows[0].there_and_back_mm, 0.2);
  EXPECT_EQ(all.rows[1].error_mm, all.still_error_mm);
  EXPECT_GT(all.still_error_mm, 1.0);
  ASSERT_EQ(all.missing.size(), 1U);
  EXPECT_THAT(all.missing[0], HasSubstr("broken (peers) was not measured: it is broken."));
}

TEST(MotionStudy, HalvesAPairWithoutMovingIt) {
  const MotionCase whole = heart_case(64), half = halved(whole);
  EXPECT_EQ(half.fixed.grid.size, glm::ivec3(32));
  EXPECT_DOUBLE_EQ(half.voxel_mm(), 2.0 * whole.voxel_mm());
  const MotionCase made = heart_case(32);
  ASSERT_TRUE(same_geometry(half.fixed.grid, made.fixed.grid));
  double difference = 0.0;
  for (size_t n = 0; n < made.truth->u_mm.size(); ++n)
    difference =
        std::max(difference, double(glm::length(half.truth->u_mm[n] - made.truth->u_mm[n])));
  // A trilinear field of 2 mm between its samples, curvature about 1/50 mm at 5 mm of motion.
  EXPECT_LT(difference, 0.1);
}

TEST(MotionStudy, CountsTheSameWorkInEveryRun) {
  const auto context = vulkan::Context::open({});
  if (!context) GTEST_SKIP() << context.error().message;
  const MotionCase heart = heart_case(48);
  for (const char* name : {"fast", "balanced, twice the iterations"}) {
    const auto method = palpate_method(*context, *motion_setting(name));
    const auto first = method->run(heart.fixed, heart.moving);
    const auto second = method->run(heart.fixed, heart.moving);
    ASSERT_TRUE(first && second);
    EXPECT_GT(first->work_bytes, 0.0);
    EXPECT_EQ(first->work_bytes, second->work_bytes) << name;
    EXPECT_LT(error_mm(first->field, heart)->mean,
              0.5 * error_mm(still_field(heart.fixed.grid), heart)->mean);
  }
}

TEST(FeelStudy, FindsTheForceOfAStillSphere) {
  const FeelMeasure m = feel({"static", "palpate", false, Moves::kNothing}, 1);
  // README's goal is 0.5 % of forces of about 1 N; sampled at 1 mm.
  EXPECT_LT(m.rms_n, 0.02);
  EXPECT_GT(m.rms_n, 0.0);
  EXPECT_EQ(m.field_megabytes, 0.0);
}

TEST(FeelStudy, TurnsTheMotionAroundBetterWithMoreSteps) {
  double last = INFINITY;
  for (const int steps : {1, 2, 4, 8}) {
    const TurnMeasure m = picard_turn(steps, 500);
    EXPECT_EQ(m.steps, steps);
    // The contraction of the heart's field is below 0.7 everywhere (`palpate plan heart`).
    EXPECT_LT(m.residual_um, last * std::pow(0.7, steps > 1 ? steps / 2 : 0));
    last = m.residual_um;
  }
  EXPECT_LT(newton_turn(500).residual_um, 0.01);
}

}  // namespace
}  // namespace palpate::studies
