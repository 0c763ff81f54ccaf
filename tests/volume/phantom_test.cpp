#include "compute/volume/phantom.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/random.h"
#include "tests/volume/grids.h"
#include "tests/volume/jumps.h"

namespace palpate {
namespace {

double mean_inside(const Volume& volume, const Mask& mask) {
  double sum = 0.0;
  double count = 0.0;
  for (size_t n = 0; n < volume.values.size(); ++n) {
    if (!mask.values[n]) continue;
    sum += double(volume.values[n]);
    count += 1.0;
  }
  return sum / count;
}

size_t voxels_in(const Mask& mask) {
  return size_t(
      std::count_if(mask.values.begin(), mask.values.end(), [](uint8_t v) { return v != 0; }));
}

TEST(ShellPoint, ThereAndBackIsTheIdentity) {
  for (int to = 0; to < 4; ++to) {
    for (double r = 0.0; r < 80.0; r += 3.7) {
      const glm::dvec3 start = r * glm::normalize(glm::dvec3(1.0, -2.0, 0.5));
      const glm::dvec3 back = shell_point(shell_point(start, 1, to), to, 1);
      ASSERT_LT(glm::length(back - start), 1e-9) << "frame " << to << ", radius " << r;
    }
  }
}

TEST(ShellPoint, FollowsTheWrittenLawFromTheSmallestState) {
  // 20 mm: t = 20/59, b = 42 t (1 - t^2)^3; half a cycle later s = 1, a quarter later s = 1/2.
  const double t = 20.0 / 59.0;
  const double b = 42.0 * t * std::pow(1.0 - t * t, 3.0);
  EXPECT_NEAR(shell_point({0.0, 20.0, 0.0}, 0, 2).y, 20.0 + b, 1e-9);
  EXPECT_NEAR(shell_point({0.0, 0.0, -20.0}, 0, 1).z, -20.0 - 0.5 * b, 1e-9);
  EXPECT_NEAR(b, 9.8, 0.2);  // the header promises 10 mm at most
}

TEST(ShellPoint, NeverFoldsAndIsStillFarAway) {
  for (int from = 0; from < 4; ++from) {
    double before = 0.0;
    for (double r = 0.25; r < 70.0; r += 0.25) {
      const double after = shell_point({r, 0.0, 0.0}, from, from + 1).x;
      // The header's bound on b' keeps neighbours at a distance of at least 0.53 of the original
      // one in each state.
      ASSERT_GT(after - before, 0.5 * 0.25) << "frame " << from << ", radius " << r;
      before = after;
    }
    EXPECT_EQ(shell_point({0.0, 60.0, 0.0}, from, from + 1), glm::dvec3(0.0, 60.0, 0.0));
  }
}

TEST(ShellTruth, ClosesTheCycle) {
  glm::dvec3 p(11.0, 7.0, -9.0);
  const glm::dvec3 start = p;
  for (int k = 0; k < 4; ++k) p = shell_point(p, k, k + 1);
  EXPECT_LT(glm::length(p - start), 1e-8);
}

TEST(ShellTruth, HoldsOnAnObliqueGrid) {
  const Grid grid = test::oblique_grid();
  const Field truth = shell_truth(grid, 0, 1);
  const glm::dvec3 p = grid.lps_from_index({3.0, 4.0, 5.0});
  // Float rounding of a displacement of a few mm.
  EXPECT_LT(glm::length(glm::dvec3(truth.at(3, 4, 5)) - (shell_point(p, 0, 1) - p)), 1e-6);
}

TEST(ShellPhantom, IsSmallIntermediateLargeIntermediate) {
  const Grid grid = heart_grid(48);
  size_t size[4];
  for (int k = 0; k < 4; ++k) size[k] = voxels_in(shell_mask(grid, k));
  EXPECT_LT(size[0], size[1]);
  EXPECT_LT(size[1], size[2]);
  EXPECT_EQ(size[1], size[3]);
}

TEST(ShellPhantom, WarpedByTheTruthShowsTheFixedFrame) {
  const Grid grid = heart_grid(64);
  const Sequence beat = shell_phantom(64, 4, 5, 0.0);
  const Mask shell = shell_mask(grid, 0, 4, 5);
  const Field truth = shell_truth(grid, 0, 1);
  double still = 0.0;
  double warped = 0.0;
  for (int k = 0; k < 64; ++k)
    for (int j = 0; j < 64; ++j)
      for (int i = 0; i < 64; ++i) {
        if (!shell.values[grid.offset(i, j, k)]) continue;
        const glm::dvec3 at = grid.lps_from_index({i, j, k}) + glm::dvec3(truth.at(i, j, k));
        const double fixed = double(beat.frames[0].at(i, j, k));
        warped += std::abs(fixed - sample(beat.frames[1], grid.index_from_lps(at)));
        still += std::abs(fixed - double(beat.frames[1].at(i, j, k)));
      }
  // The remaining error is interpolation of 1.5-voxel edges and 2-voxel texture; without the truth
  // it is the motion.
  EXPECT_LT(warped, 0.2 * still);
}

TEST(ShellPhantom, WallIsBrighterThanBloodAndLung) {
  const Grid grid = heart_grid(48);
  const Sequence beat = shell_phantom(48);
  EXPECT_GT(mean_inside(beat.frames[2], shell_mask(grid, 2)), 800.0);
  EXPECT_NEAR(double(beat.frames[2].at(24, 24, 24)), 350.0, 80.0);  // texture 40, noise 9
  EXPECT_NEAR(double(beat.frames[2].at(1, 1, 1)), 100.0, 120.0);    // texture 80, noise 9
}

TEST(ShellValue, HasNoJumps) {
  // The largest step is 900 plus the textures' 420, in 1.5 mm, at the steepest 1.5 times that.
  constexpr double kSlope = 1.5 * 1320.0 / 1.5;
  test::Random random(1);
  for (int draw = 0; draw < 200; ++draw) {
    const glm::dvec3 from = random.vector(60.0);
    const double change = test::largest_narrow_change(
        [&](glm::dvec3 at) { return shell_value(at, draw % kShellFrames); }, from,
        random.direction());
    ASSERT_LT(change, kSlope * test::kNarrow_mm) << "draw " << draw;
  }
}

TEST(ShellPhantom, NoiseHasTheAskedSdAndTheSeedDecides) {
  const Sequence clean = shell_phantom(32, 2, 8, 0.0);
  const Sequence noisy = shell_phantom(32, 2, 8, 0.02);
  double sum = 0.0;
  double squares = 0.0;
  const size_t count = clean.frames[0].values.size();
  for (size_t n = 0; n < count; ++n) {
    const double e = double(noisy.frames[0].values[n]) - double(clean.frames[0].values[n]);
    sum += e;
    squares += e * e;
  }
  // 32,768 draws: the SD of the mean is 18 / 181 = 0.1 and of the SD 0.07; the limit is five of
  // these.
  EXPECT_NEAR(sum / double(count), 0.0, 0.5);
  EXPECT_NEAR(std::sqrt(squares / double(count)), 18.0, 0.35);
  EXPECT_EQ(noisy.frames[1].values, shell_phantom(32, 2, 8, 0.02).frames[1].values);
  EXPECT_NE(noisy.frames[0].values, shell_phantom(32, 2, 9, 0.02).frames[0].values);
}

TEST(SlidingPhantom, MovesTheOrganAndLeavesTheWall) {
  const SlidingPhantom pair = sliding_phantom(48, 10.0, 3, 0.0);
  const Grid& grid = pair.fixed.grid;
  EXPECT_GT(voxels_in(pair.organ), 5000u);
  EXPECT_GT(voxels_in(pair.wall), 5000u);
  for (int k = 0; k < 48; ++k)
    for (int j = 0; j < 48; ++j)
      for (int i = 0; i < 48; ++i) {
        const size_t n = grid.offset(i, j, k);
        if (pair.organ.values[n]) {
          ASSERT_EQ(pair.truth.u_mm[n], glm::vec3(0.0F, 0.0F, 10.0F));
          const bool off_the_side = pair.organ.values[n - 1] && pair.organ.values[n + 1] &&
                                    pair.organ.values[n - 48] && pair.organ.values[n + 48];
          // A rigid motion by whole voxels: the same texture at the same place of the organ. The
          // scanner's blur mixes in the wall within 0.75 voxel of the side, and the wall does not
          // move.
          if (off_the_side) {
            ASSERT_FLOAT_EQ(pair.fixed.values[n], pair.moving.at(i, j, k + 10));
          }
        } else if (pair.wall.values[n]) {
          ASSERT_EQ(pair.truth.u_mm[n], glm::vec3(0.0F));
        }
      }
}

TEST(SlidingPhantom, OrganAndWallTouch) {
  const SlidingPhantom pair = sliding_phantom(48, 10.0, 3, 0.0);
  int touching = 0;
  for (int i = 1; i < 48; ++i) {
    const size_t n = pair.fixed.grid.offset(i, 24, 24);
    touching += pair.organ.values[n] != 0 && pair.wall.values[n - 1] != 0;
    touching += pair.organ.values[n - 1] != 0 && pair.wall.values[n] != 0;
  }
  EXPECT_EQ(touching, 2);
}

}  // namespace
}  // namespace palpate
