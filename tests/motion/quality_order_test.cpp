// What one motion for a sequence does between its frames, and whether its frames follow each other
// like those of a movement. Oracles: motions in closed form.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "compute/motion/sequence_quality.h"
#include "tests/support/random.h"

namespace palpate {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kTau = 2.0 * std::numbers::pi;

/// Frames in which each sample moves its own way, by `shares` of it and by noise.
SequenceMotion moved_by(const std::vector<double>& shares, bool cyclic, double noise_mm = 0.0) {
  test::Random random(9);
  SequenceMotion motion;
  Grid grid;
  grid.size = {6, 5, 4};
  std::vector<glm::dvec3> ways;
  for (size_t s = 0; s < grid.count(); ++s)
    ways.push_back(glm::dvec3(8.0, 2.0, 0.0) + random.vector(1.0));
  for (size_t k = 0; k < shares.size(); ++k) {
    motion.basis.times_s.push_back(double(k));
    motion.terms.push_back(still_field(grid));
    for (size_t s = 0; s < grid.count(); ++s)
      motion.terms.back().u_mm[s] = glm::vec3(shares[k] * ways[s] + random.vector(noise_mm));
  }
  if (cyclic) motion.basis.cycle_s = double(shares.size());
  return motion;
}

std::vector<double> breath(size_t frames, double cycles = 1.0) {
  std::vector<double> shares;
  for (size_t k = 0; k < frames; ++k)
    shares.push_back(0.5 - 0.5 * std::cos(kTau * cycles * double(k) / double(frames)));
  return shares;
}

std::vector<std::string> reasons_of(const SequenceMotion& motion) {
  const auto evidence = examined(motion, {}, {}, nullptr, {});
  return judged(*evidence->order, evidence->ordered_by).reasons;
}

TEST(BetweenFrames, WhatNoFrameSupportsIsFound) {
  SequenceMotion motion = moved_by(breath(8), true);
  for (const BetweenFrames& step : between_frames(motion)) {
    EXPECT_EQ(step.excursion.beyond_voxels, 0.0);
    EXPECT_LT(step.excursion.mm, 1.0);
  }
  // A sine that is zero at every frame: no frame shows it.
  const std::vector<Field> at_frame = motion.terms;
  motion.basis.harmonics = 4;
  motion.terms.assign(motion.basis.terms(), still_field(at_frame.front().grid));
  for (glm::vec3& u : motion.terms.back().u_mm) u.z = 5.0F;
  for (size_t k = 0; k < 8; ++k)
    EXPECT_NEAR(motion.at_frame(k).u_mm.front().z, 0.0F, 1e-5F) << "the frames do not move";
  const auto evidence = examined(motion, {}, {}, nullptr, {});
  EXPECT_NEAR(evidence->frames[2].excursion.mm, 5.0, 1e-4);
  EXPECT_THAT(judged(*evidence).reasons,
              Contains(HasSubstr("After frame 2: The path leaves the straight line")));
  EXPECT_EQ(judged(*evidence).trust, Trust::kFailed);
}

TEST(OrderOfFrames, IsRightForMovements) {
  for (const bool cyclic : {false, true})
    for (const double noise_mm : {0.0, 0.15}) {
      for (size_t frames = 4; frames <= 20; ++frames)
        EXPECT_THAT(reasons_of(moved_by(breath(frames), cyclic, noise_mm)), IsEmpty()) << frames;
      EXPECT_THAT(reasons_of(moved_by(breath(24, 4.0), cyclic, noise_mm)), IsEmpty());
      // From rest to rest, a single change, and none.
      EXPECT_THAT(reasons_of(moved_by({0, 0, 0, 0.5, 1, 1, 1}, false, noise_mm)), IsEmpty());
      EXPECT_THAT(reasons_of(moved_by({0, 0, 0, 1, 1, 1, 1}, false, noise_mm)), IsEmpty());
      EXPECT_THAT(reasons_of(moved_by({0, 0, 0, 0, 0, 0}, cyclic, noise_mm)), IsEmpty());
      EXPECT_THAT(reasons_of(moved_by({0, 1, 0}, false, noise_mm)), IsEmpty()) << "too few";
    }
}

TEST(OrderOfFrames, ThatIsShuffledIsNamedInOneSentence) {
  const std::vector<double> shares = breath(12);
  std::vector<size_t> order(shares.size());
  test::Random random(4);
  int found = 0;
  for (int trial = 0; trial < 50; ++trial) {
    std::iota(order.begin(), order.end(), 0U);
    for (size_t k = order.size() - 1; k > 0; --k)
      std::swap(order[k], order[size_t(random.below(int(k) + 1))]);
    std::vector<double> shuffled;
    for (const size_t k : order) shuffled.push_back(shares[k]);
    const auto reasons = reasons_of(moved_by(shuffled, false, 0.2));
    found += !reasons.empty();
    if (!reasons.empty()) {
      EXPECT_THAT(reasons.front(), HasSubstr("The path jumps to and fro: frame "));
      EXPECT_THAT(reasons.front(), HasSubstr("check the order of the frames"));
    }
  }
  EXPECT_GE(found, 45);
}

TEST(OrderOfFrames, NamesTheFrameAndTheTagThatPutItThere) {
  const SequenceMotion motion = moved_by({0.0, 0.25, 0.75, 0.5, 1.0, 1.25}, false);
  auto evidence = examined(motion, {}, {}, nullptr, {});
  ASSERT_TRUE(evidence);
  const FrameOrder& order = *evidence->order;
  EXPECT_TRUE(order.frame == 2 || order.frame == 3);
  EXPECT_NEAR(order.before_mm / order.after_mm, order.frame == 2 ? 2.0 : 0.5, 1e-6);
  EXPECT_NEAR(order.apart_mm, std::abs(order.before_mm - order.after_mm), 1e-5);
  evidence->ordered_by = "TriggerTime (0018,1060)";
  EXPECT_THAT(judged(*evidence).reasons,
              Contains(HasSubstr("Sequence: The path jumps to and fro")));
  EXPECT_THAT(judged(*evidence).reasons,
              Contains(HasSubstr("order of the frames, now by TriggerTime (0018,1060).")));
}

TEST(OrderOfFrames, IsTheSameFromFieldsOfSteps) {
  const SequenceMotion motion = moved_by({0.0, 0.4, 0.05, 0.5, 0.3}, false);
  const Grid& grid = motion.terms.front().grid;
  FrameOrderMeter meter(grid, nullptr, 1.0);
  for (size_t k = 0; k + 1 < motion.frames(); ++k) {
    // All material moves alike, so a step is the same in every frame's places.
    Field step = still_field(grid);
    const glm::vec3 by_mm = motion.terms[k + 1].u_mm.front() - motion.terms[k].u_mm.front();
    std::fill(step.u_mm.begin(), step.u_mm.end(), by_mm);
    meter.follow(step);
  }
  const FrameOrder steps = meter.found(false);
  const FrameOrder whole = *examined(motion, {}, {}, nullptr, {})->order;
  EXPECT_EQ(steps.frames, whole.frames);
  EXPECT_EQ(steps.frame, whole.frame);
  EXPECT_NEAR(steps.to_and_fro, whole.to_and_fro, 1e-3);
  EXPECT_NEAR(steps.onward, whole.onward, 1e-3);
}

}  // namespace
}  // namespace palpate
