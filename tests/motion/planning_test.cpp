#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <glm/gtc/packing.hpp>
#include <set>

#include "compute/motion/activity.h"
#include "compute/motion/intensity.h"
#include "compute/motion/noise.h"
#include "compute/motion/plan.h"
#include "compute/motion/selection.h"
#include "compute/motion/solver.h"
#include "compute/volume/phantom_texture.h"
#include "tests/motion/made_pairs.h"
#include "tests/motion/oracle/oracle.h"
#include "tests/support/random.h"
#include "tests/support/tolerances.h"

/// What the CPU decides before the device works and between its steps.
namespace palpate::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

uint32_t brick(int x, int y, int z) {
  return uint32_t(x) | uint32_t(y) << 10 | uint32_t(z) << 20;
}

TEST(BrickList, CoversEveryCellOnceAtAnySize) {
  for (const glm::ivec3 cells : {glm::ivec3(1), glm::ivec3(8), glm::ivec3(9, 7, 17)}) {
    const BrickList bricks = all_bricks(cells);
    const std::set<uint32_t> distinct(bricks.begin(), bricks.end());
    EXPECT_EQ(distinct.size(), bricks.size());
    oracle::for_each(cells, [&](glm::ivec3 cell) {
      const glm::ivec3 b = cell / shaders::kBrick;
      EXPECT_EQ(distinct.count(brick(b.x, b.y, b.z)), 1U);
    });
    const glm::ivec3 n = brick_count(cells);
    EXPECT_EQ(bricks.size(), size_t(n.x * n.y * n.z));
  }
}

/// A row of six bricks of still cells with structure.
class ActiveBricks : public ::testing::Test {
 protected:
  BrickList active() const { return active_bricks(bricks, looks, cells, rule); }

  const glm::ivec3 cells{48, 8, 8};
  BrickList bricks = all_bricks(cells);
  std::vector<BrickMeasure> looks = std::vector<BrickMeasure>(6, BrickMeasure{0.0F, 1.0F, 0.0F});
  RestRule rule{0.01, 0.6, 0.25};
};

TEST_F(ActiveBricks, AreNoneWhenNothingMoves) {
  EXPECT_THAT(active(), IsEmpty());
}

TEST_F(ActiveBricks, AreThoseThatMoveAndTheirNeighboursInOrder) {
  looks[0].moved = 0.02F;
  // Just enough to count as moved.
  looks[4].moved = 0.0101F;
  looks[2].moved = 0.0099F;
  EXPECT_THAT(active(), ElementsAre(brick(0, 0, 0), brick(1, 0, 0), brick(3, 0, 0), brick(4, 0, 0),
                                    brick(5, 0, 0)));
}

TEST_F(ActiveBricks, LeaveOutFlatOnesThatStayedInPlace) {
  looks[2].moved = 0.5F;
  looks[2].reach = 0.5F;
  looks[1].structure = looks[3].structure = 0.3F;
  looks[3].reach = 0.4F;
  EXPECT_THAT(active(), ElementsAre(brick(2, 0, 0), brick(3, 0, 0)));
}

TEST_F(ActiveBricks, LeaveOutWhatIsMaskedOutHoweverItMoves) {
  looks[2] = {5.0F, 0.0F, 5.0F};
  EXPECT_THAT(active(), ElementsAre(brick(1, 0, 0), brick(3, 0, 0)));
}

TEST_F(ActiveBricks, NeverReturnThatWereNotListed) {
  bricks = {brick(1, 0, 0), brick(5, 0, 0)};
  looks.assign(2, BrickMeasure{1.0F, 1.0F, 1.0F});
  EXPECT_THAT(active(), ElementsAre(brick(1, 0, 0), brick(5, 0, 0)));
}

TEST(MotionPreset, ExistsForEveryListedNameAndNoOther) {
  for (const std::string_view name : kMotionPresets) {
    const std::optional<MotionOptions> options = motion_preset(name);
    ASSERT_TRUE(options) << name;
    EXPECT_EQ(options->preset, name);
    EXPECT_FALSE(options->levels.empty());
  }
  EXPECT_FALSE(motion_preset("fastest"));
  EXPECT_FALSE(motion_preset(""));
}

/// Cells whose remaining difference comes from noise of a given strength and from a motion that was
/// not found.
std::vector<CellLeft> cells_left(double noise, double motion, size_t count, uint32_t seed) {
  Random random(seed);
  std::vector<CellLeft> cells;
  for (size_t i = 0; i < count; ++i) {
    const double q = random.draw(0.0, 0.95);
    const double r2 = noise * (1.0 - q) + 2.0 * motion * q;
    cells.push_back({float(q), float(r2 * random.draw(0.8, 1.2))});
  }
  return cells;
}

TEST(NoiseLeft, TellsNoiseFromMotionByTheStructureWhereItIs) {
  // The lower quartile of draws from 0.8 to 1.2 is 0.9.
  EXPECT_NEAR(*noise_left(cells_left(0.05, 0.0, 4000, 1)), 0.045, 0.003);
  EXPECT_NEAR(*noise_left(cells_left(0.05, 0.08, 4000, 2)), 0.045, 0.009);
  EXPECT_NEAR(*noise_left(cells_left(0.0, 0.08, 4000, 3)), 0.0, 0.006);
}

TEST(NoiseLeft, IsNotSaidWithFewCellsAndIsZeroWithoutDifferences) {
  EXPECT_FALSE(noise_left(cells_left(0.05, 0.0, 63, 4)));
  EXPECT_FALSE(noise_left({}));
  EXPECT_EQ(noise_left(cells_left(0.0, 0.0, 500, 5)), 0.0);
  EXPECT_EQ(noise_left(std::vector<CellLeft>(500, CellLeft{1.0F, 0.3F})), 0.0);
}

TEST(CycleStep, IsStableAsAWholeAndLeadsFurtherThanEqualSteps) {
  for (int n = 1; n <= 8; ++n) {
    SCOPED_TRACE(n);
    double sum = 0.0;
    for (int k = 0; k < n; ++k) {
      sum += cycle_step(k, n);
      if (k > 0) {
        EXPECT_LT(cycle_step(k, n), cycle_step(k - 1, n));
      }
    }
    EXPECT_NEAR(sum, n * (n + 1) / 3.0, 1e-12 * n * n);
    // What a cycle makes of each eigenvalue; a step of 1 is the longest that is stable alone.
    for (int i = 0; i <= 1000; ++i) {
      double left = 1.0;
      for (int k = 0; k < n; ++k) left *= 1.0 - 2.0 * cycle_step(k, n) * i / 1000.0;
      EXPECT_LE(std::abs(left), 1.0 + 1e-12) << "eigenvalue " << i;
    }
  }
}

/// Cells of rising structure, of which the quarter with the least has the k and u of its name and
/// the others those of motion.
std::vector<CellNoise> cells_noise(float shared, float share, size_t count) {
  std::vector<CellNoise> cells;
  for (size_t i = 0; i < count; ++i) {
    // Not in the order of their structure.
    const size_t place = i * 7919 % count;
    const bool least = place < count / 4;
    cells.push_back({float(place) / float(count), least ? shared : 9.0F, least ? share : 0.9F});
  }
  return cells;
}

TEST(CellsShareNoise, WhereTheFramesShowLeastAndDifferInThatToo) {
  EXPECT_TRUE(cells_share_noise(cells_noise(6.8F, 0.57F, 4000)));
  EXPECT_TRUE(cells_share_noise(cells_noise(3.4F, 0.21F, 4000)));
  // White noise, and motion that was not found.
  EXPECT_FALSE(cells_share_noise(cells_noise(0.7F, 0.95F, 4000)));
  EXPECT_FALSE(cells_share_noise(cells_noise(12.0F, 0.05F, 4000)));
}

TEST(CellsShareNoise, IsTakenForTrueWithFewCells) {
  EXPECT_TRUE(cells_share_noise(cells_noise(0.7F, 0.95F, 63)));
  EXPECT_FALSE(cells_share_noise(cells_noise(0.7F, 0.95F, 64)));
  EXPECT_TRUE(cells_share_noise({}));
}

TEST(MotionPlan, CountsTheImagesOfTheSecondWindow) {
  const Grid grid = plain_grid({96, 80, 64});
  MotionOptions one = *motion_preset("balanced");
  one.yield.window = 0.0;
  MotionOptions two = one;
  two.yield.window = 2.5;
  const MotionPlan with = plan_motion(grid, two), without = plan_motion(grid, one);
  EXPECT_TRUE(yields(with, 0));
  EXPECT_FALSE(yields(with, 1));
  EXPECT_FALSE(yields(without, 0));
  // Four images of fp16 cells, and the result of the level above, which is read back.
  const glm::ivec3 cells = with.levels[0].cells, above = with.levels[1].cells;
  EXPECT_GE(solver_bytes(with) - solver_bytes(without),
            uint64_t(8) * (4 * uint64_t(cells.x * cells.y * cells.z) +
                           uint64_t(above.x * above.y * above.z)));
  two.coarse_levels = 1;
  // There is no coarser level to compare with.
  EXPECT_FALSE(yields(plan_motion(grid, two), 0));
}

/// Grids for which a valid plan must exist: thin, long, anisotropic, tiny, oblique.
std::vector<Grid> awkward_grids() {
  Grid oblique = oblique_grid();
  oblique.size = {130, 77, 31};
  return {plain_grid({1, 1, 1}),
          plain_grid({64, 64, 1}),
          plain_grid({512, 3, 5}),
          plain_grid({100, 100, 20}, {0.7, 0.7, 5.0}),
          plain_grid({9, 200, 9}, {5.0, 0.5, 1.0}),
          oblique};
}

TEST(MotionPlan, CoversTheImageOnEveryLevel) {
  for (const Grid& grid : awkward_grids()) {
    const MotionPlan plan = plan_motion(grid, *motion_preset("balanced"));
    ASSERT_FALSE(plan.levels.empty());
    EXPECT_TRUE(same_geometry(plan.field, coarsened(grid, result_level(plan).cell)));
    for (size_t l = 0; l < plan.levels.size(); ++l) {
      const LevelPlan& level = plan.levels[l];
      const Grid images = level_grid(plan, l), cells = field_grid(plan, l);
      EXPECT_EQ(images.size, level.image_size);
      EXPECT_EQ(cells.size, level.cells);
      // The corner of the image, half a voxel outside its first sample, stays in place.
      const glm::dvec3 corner = grid.lps_from_index(glm::dvec3(-0.5));
      EXPECT_LT(glm::distance(images.lps_from_index(glm::dvec3(-0.5)), corner), 1e-9);
      EXPECT_LT(glm::distance(cells.lps_from_index(glm::dvec3(-0.5)), corner), 1e-9);
      for (int a = 0; a < 3; ++a) {
        const double edge_mm = grid.size[a] * grid.spacing_mm[a];
        EXPECT_GE(cells.size[a] * cells.spacing_mm[a], edge_mm - 1e-9);
        EXPECT_LT((cells.size[a] - 1) * cells.spacing_mm[a], edge_mm);
      }
    }
  }
}

TEST(MotionPlan, ShrinksTowardsVoxelsOfEqualEdges) {
  const MotionPlan plan =
      plan_motion(plain_grid({256, 256, 32}, {0.5, 0.5, 4.0}), *motion_preset("balanced"));
  for (size_t l = 1; l < plan.levels.size(); ++l) {
    EXPECT_EQ(plan.levels[l].h_mm, 2.0 * plan.levels[l - 1].h_mm);
    // Thick slices are halved only after the other axes have come within about one halving of them.
    const glm::dvec3 s = plan.levels[l].spacing_mm;
    if (s.z > 4.0) {
      EXPECT_GE(s.x, 0.5 * s.z / 1.42);
    }
  }
  EXPECT_LE(plan.levels.back().image_size.x, 24);
}

TEST(IntensityScaling, SpreadsThePercentilesOverOne) {
  Volume ramp{plain_grid({100, 10, 10}), {}};
  for (int i = 0; i < 10000; ++i) ramp.values.push_back(float(i));
  const IntensityScale scale = intensity_scale(ramp);
  EXPECT_NEAR(scale.offset, 100.0, 1.0);
  EXPECT_NEAR(1.0 / scale.scale, 9800.0, 2.0);
}

TEST(IntensityScaling, TakesTheExtremesOfASmallObjectInAnEmptyFrame) {
  Volume empty{plain_grid({20, 20, 20}), std::vector<float>(8000, 5.0F)};
  const IntensityScale nothing = intensity_scale(empty);
  EXPECT_EQ(nothing.offset, 5.0F);
  EXPECT_EQ(nothing.scale, 1.0F);
  empty.values[4000] = 105.0F;
  EXPECT_FLOAT_EQ(intensity_scale(empty).scale, 0.01F);
}

TEST(AtRanks, IsWhatSortingPutsThere) {
  Random random(11);
  for (const size_t n : {size_t(1), size_t(2), size_t(1000)}) {
    std::vector<float> values;
    // Values of both signs and many magnitudes; most of them occur several times.
    for (size_t i = 0; i < n; ++i)
      values.push_back(float(std::round(random.draw(-8.0, 8.0)) *
                             std::pow(10.0, std::round(random.draw(-30.0, 30.0)))));
    if (n > 2) values[5] = std::numeric_limits<float>::infinity(), values[6] = -values[5];
    std::vector<float> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    for (size_t k = 0; k < n; ++k)
      EXPECT_EQ(at_ranks<1>(values, {k})[0], sorted[k]) << k << " of " << n;
  }
}

TEST(NoiseFloor, FollowsTheNoiseInScaledUnitsBetweenItsBounds) {
  Volume noisy{plain_grid({40, 40, 40}), {}};
  for (size_t i = 0; i < 64000; ++i) {
    noisy.values.push_back(float(1000.0 + 30.0 * texture::gaussian_like(7, i)));
  }
  const double sd = noise_sd(noisy);
  // As for intensity ranges of 800, 100000 and 80: 2.2 SDs are 0.0825, then too small, then too
  // large. The SD of 54,872 correlated draws is right to 5 % (see NoiseSd).
  EXPECT_NEAR(noise_floor(sd, {0.0F, 1.0F / 800.0F}, 0.0), 0.0825, 0.05 * 0.0825);
  EXPECT_EQ(noise_floor(sd, {0.0F, 1e-5F}, 0.0), 0.02);
  EXPECT_EQ(noise_floor(sd, {0.0F, 1.0F / 80.0F}, 0.0), 0.25);
  // A value that the user sets is taken as it is.
  EXPECT_EQ(noise_floor(sd, {0.0F, 1.0F / 800.0F}, 0.004), 0.004);
}

TEST(IntensityScaling, RoundsToTheNearestHalfAndHoldsTheFarOut) {
  Volume volume{plain_grid({1, 1, 9}),
                {0.0F, 1.0F, -1.0F, 0.3333F, 1e-3F, -59.99F, 1e6F, -1e6F, 2.00048828F}};
  const HalfVolume halves = scaled_halves(volume, {});
  for (size_t i = 0; i < volume.values.size(); ++i) {
    const float held = std::clamp(volume.values[i], -60.0F, 60.0F);
    EXPECT_EQ(halves.bits[i], glm::packHalf1x16(held)) << volume.values[i];
  }
  // A value below the normal numbers of fp16 becomes zero.
  volume.values.assign(9, 1e-5F);
  EXPECT_EQ(scaled_halves(volume, {}).bits[0], 0);
}

TEST(PlanSearches, ComeAfterEveryLevelAboveTheSecondAndInSmallVolumesToo) {
  const MotionOptions options = *motion_preset("balanced");
  const auto levels = [&](glm::ivec3 size) {
    std::vector<int> result;
    for (const SearchPlan& search : plan_searches(plan_motion(plain_grid(size), options)))
      result.push_back(int(search.level));
    return result;
  };
  EXPECT_THAT(levels(glm::ivec3(128)), ElementsAre(3, 2));
  EXPECT_THAT(levels(glm::ivec3(64)), ElementsAre(2));
  EXPECT_THAT(levels(glm::ivec3(48)), ElementsAre(1));
  // There is a single level, so there is no coarse level to start from.
  EXPECT_THAT(levels(glm::ivec3(24)), IsEmpty());
}

TEST(PlanSearches, ReachLessFarTheMoreNodesThereAre) {
  MotionOptions options = *motion_preset("balanced");
  const auto search = plan_searches(plan_motion(plain_grid({128, 128, 64}, {1, 1, 4}), options));
  ASSERT_FALSE(search.empty());
  const SearchPlan& finest = search.back();
  EXPECT_EQ(finest.reach_for(1), finest.most);
  glm::ivec3 before = finest.most;
  for (size_t nodes = 1; nodes < 1000000; nodes *= 4) {
    const glm::ivec3 reach = finest.reach_for(nodes);
    EXPECT_LE(reach.x, before.x);
    EXPECT_TRUE(reach == glm::ivec3(0) || double(nodes) * SearchPlan::labels(reach) <= finest.work);
    before = reach;
  }
  EXPECT_EQ(finest.reach_for(size_t(finest.work)), glm::ivec3(0));
}

}  // namespace
}  // namespace palpate::test
