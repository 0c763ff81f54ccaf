// One frame's values carried by one motion. Oracle: the phantom, whose frames are made of material
// that moves in a known way, so that carried frames and made frames are the same.
#include "integration/app/carried_values.h"

#include <gtest/gtest.h>

#include "compute/volume/phantom.h"

namespace palpate::app {
namespace {

TEST(CarriedValues, AreThoseOfTheMaterialInEveryFrame) {
  constexpr int kFrames = 4;
  const Grid grid = heart_grid(64);
  const Sequence heart = shell_phantom(grid, kFrames, 1, 0.0);
  MovingVolume own;
  own.name = "heart";
  own.times = {heart.times_s, 1.0};
  for (const Volume& frame : heart.frames) own.frames.push_back(sampled_scalar(frame));
  SequenceMotion motion;
  motion.reference = 2;
  motion.times_s = heart.times_s;
  motion.cycle_s = 1.0;
  // The material's places are told from frame 1: the reference frame itself has moved there.
  for (int k = 0; k < kFrames; ++k) motion.at_frame.push_back(shell_truth(grid, 1, k, kFrames));
  const MovingVolume carried = with_carried_values(own, motion, grid);
  EXPECT_TRUE(check(carried));
  ASSERT_EQ(carried.frames.size(), size_t(kFrames));
  EXPECT_EQ(carried.frames[2], own.frames[2]) << "the reference frame is its own";
  for (int k = 0; k < kFrames; ++k) {
    double sum = 0.0, before = 0.0;
    size_t count = 0;
    for (int z = 4; z < 60; z += 2)
      for (int y = 4; y < 60; y += 2)
        for (int x = 4; x < 60; x += 2, ++count) {
          const glm::dvec3 at = volume_from_lps(grid.lps_from_index({x, y, z}));
          const double difference =
              carried.frames[size_t(k)]->scalar(at) - own.frames[size_t(k)]->scalar(at);
          const double still = own.frames[2]->scalar(at) - own.frames[size_t(k)]->scalar(at);
          sum += difference * difference;
          before += still * still;
        }
    if (k == 2) continue;
    // Edges of 1.5 samples, stretched by the motion, are what is left.
    EXPECT_LT(sum, 0.02 * before) << "frame " << k;
  }
  for (int k = 0; k < kFrames; ++k) {
    const Field truth = shell_truth(grid, k, (k + 1) % kFrames, kFrames);
    double worst_mm = 0.0;
    for (int z = 8; z < 56; z += 3)
      for (int y = 8; y < 56; y += 3)
        for (int x = 8; x < 56; x += 3) {
          const glm::dvec3 lps_mm = grid.lps_from_index({x, y, z});
          const glm::dvec3 u_m =
              carried.motions[0].steps[size_t(k)]->displacement(volume_from_lps(lps_mm));
          worst_mm = std::max(
              worst_mm, 1e3 * glm::distance(u_m, volume_from_lps(glm::dvec3(truth.at(x, y, z)))));
        }
    EXPECT_LT(worst_mm, 0.1) << "step " << k;
  }
}

}  // namespace
}  // namespace palpate::app
