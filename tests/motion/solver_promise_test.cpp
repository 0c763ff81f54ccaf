#include <array>
#include <cstring>
#include <future>

#include "tests/motion/solver_test.h"
#include "tests/support/tolerances.h"

/// What the estimation guarantees for any data, meaningful or not: no folds, equal bits in every
/// run, and no influence of one estimation on another.
namespace palpate::test {
namespace {

class SolverPromise : public SolverTest {
 protected:
  /// Tests the field as it is written to files: at every voxel of the image.
  void expect_no_folds(const Volume& fixed, const Volume& moving, const std::string& what) {
    for (const std::string name : {"fast", "balanced", "best"}) {
      SCOPED_TRACE(what + ", " + name);
      const PairMotion motion = motion_of(fixed, moving, preset(name));
      EXPECT_EQ(motion.report.folded_cells, 0U) << motion.report.repaired << " rounds of repair";
      const Folds found = folds(resampled(motion.field, fixed.grid));
      EXPECT_EQ(found.folded, 0U);
      EXPECT_EQ(found.not_finite, 0U);
      EXPECT_GT(found.min_det, 0.0);
      for (const float confidence : motion.confidence.values) {
        ASSERT_GE(confidence, 0.0F);
        ASSERT_LE(confidence, 1.0F + float(kSingle));
      }
    }
  }
};

bool same_bits(const Field& a, const Field& b) {
  return a.u_mm.size() == b.u_mm.size() &&
         std::memcmp(a.u_mm.data(), b.u_mm.data(), a.u_mm.size() * sizeof(glm::vec3)) == 0;
}

bool same_bits(const PairMotion& a, const PairMotion& b) {
  return same_bits(a.field, b.field) && a.confidence.values == b.confidence.values;
}

TEST_F(SolverPromise, NoFoldsBetweenFramesOfPureNoise) {
  const Grid grid = plain_grid({40, 33, 36}, {1.0, 1.2, 0.8});
  for (uint32_t seed = 1; seed <= 2; ++seed)
    expect_no_folds(noise_volume(grid, seed), noise_volume(grid, seed + 10),
                    "seed " + std::to_string(seed));
}

TEST_F(SolverPromise, NoFoldsBetweenUnrelatedBodies) {
  const Grid grid = plain_grid({40, 40, 40});
  const Volume one = made_pair(grid, {}, 1).fixed;
  const Volume other = made_pair(grid, {}, 2).fixed;
  expect_no_folds(one, other, "one to the other");
  expect_no_folds(other, one, "and back");
}

TEST_F(SolverPromise, NoFoldsBetweenCheckerboardsThatSwap) {
  const Grid grid = plain_grid({28, 28, 28});
  for (const int edge : {1, 3, 6})
    expect_no_folds(checkerboard(grid, edge, 0), checkerboard(grid, edge, 1),
                    "edge " + std::to_string(edge));
}

/// So little smoothing that the estimation folds and only the repair removes the folds: on a cube,
/// on thick slices, on two slices and on a single one.
TEST_F(SolverPromise, NoFoldsAreLeftWhereTheEstimationItselfFolds) {
  const std::array<Grid, 4> grids = {plain_grid({48, 40, 36}),
                                     plain_grid({40, 36, 9}, {0.7, 0.8, 4.0}),
                                     plain_grid({48, 40, 2}), plain_grid({112, 96, 1})};
  EstimatorOptions options = preset("balanced");
  options.motion.damping = 0.02;
  for (LevelOptions& level : options.motion.levels) {
    level.window = 0.7;
    level.smoothness = 0.01;
  }
  for (const Grid& grid : grids) {
    SCOPED_TRACE(std::to_string(grid.size.z) + " slices");
    const PairMotion motion = motion_of(noise_volume(grid, 1), noise_volume(grid, 2), options);
    EXPECT_GT(motion.report.repaired, 0);
    EXPECT_EQ(motion.report.folded_cells, 0U);
    const Folds found = folds(resampled(motion.field, grid));
    EXPECT_EQ(found.folded, 0U);
    // The limit itself, with a margin for the rounding of the interpolation.
    EXPECT_GT(found.min_det, 0.5 * options.motion.min_determinant);
  }
}

TEST_F(SolverPromise, NoFoldsOnThickSlicesOrWhenAFrameIsMirrored) {
  Grid grid = plain_grid({40, 36, 9}, {0.7, 0.8, 4.0});
  grid.direction = some_rotation(5);
  const Volume body = made_pair(grid, {}, 3).fixed;
  Volume mirrored = body;
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i)
        mirrored.values[grid.offset(i, j, k)] = body.at(grid.size.x - 1 - i, j, k);
  expect_no_folds(body, mirrored, "mirrored");
}

TEST_F(SolverPromise, TheSameBitsEveryTime) {
  AffineMap map;
  map.shift_mm = {2.3, -1.4, 0.9};
  const MadePair pair = made_pair(plain_grid({40, 36, 44}), map);
  for (const std::string name : {"balanced", "classic"}) {
    const PairMotion first = motion_of(pair.fixed, pair.moving, preset(name));
    const PairMotion second = motion_of(pair.fixed, pair.moving, preset(name));
    EXPECT_TRUE(same_bits(first, second)) << name;
  }
}

TEST_F(SolverPromise, TheSameBitsForTwoEstimationsAtOnceOnOneDevice) {
  AffineMap there, back;
  there.shift_mm = {2.3, -1.4, 0.9};
  back.shift_mm = {-1.1, 0.7, 1.9};
  const MadePair pairs[2] = {made_pair(plain_grid({40, 36, 44}), there, 1),
                             made_pair(plain_grid({33, 41, 37}), back, 2)};
  const auto estimate = [&](int which) {
    return motion_of(pairs[which].fixed, pairs[which].moving, preset("balanced"));
  };
  const PairMotion alone[2] = {estimate(0), estimate(1)};
  auto first = std::async(std::launch::async, estimate, 0);
  auto second = std::async(std::launch::async, estimate, 1);
  EXPECT_TRUE(same_bits(first.get(), alone[0]));
  EXPECT_TRUE(same_bits(second.get(), alone[1]));
}

TEST_F(SolverPromise, NothingStaysOnTheDeviceAfterAnEstimation) {
  const MadePair pair = made_pair(plain_grid({32, 30, 28}), {});
  const uint64_t before = context()->memory_used_bytes();
  motion_of(pair.fixed, pair.moving, preset("fast"));
  EXPECT_EQ(context()->memory_used_bytes(), before);
}

}  // namespace
}  // namespace palpate::test
