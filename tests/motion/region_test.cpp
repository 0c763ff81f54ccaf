#include "compute/motion/region.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/motion/made_pairs.h"
#include "tests/motion/oracle/oracle.h"

/// The part of the work that remains with a mask.
namespace palpate::test {
namespace {

Mask box_mask(const Grid& grid, glm::ivec3 begin, glm::ivec3 end) {
  Mask mask{grid, std::vector<uint8_t>(grid.count())};
  oracle::for_each(grid.size, [&](glm::ivec3 i) {
    mask.values[grid.offset(i.x, i.y, i.z)] =
        glm::all(glm::greaterThanEqual(i, begin)) && glm::all(glm::lessThan(i, end));
  });
  return mask;
}

/// Every eighth voxel of every seventh row of a slab: a mask with many holes.
Mask scattered_mask(const Grid& grid) {
  Mask mask{grid, std::vector<uint8_t>(grid.count())};
  oracle::for_each(grid.size, [&](glm::ivec3 i) {
    mask.values[grid.offset(i.x, i.y, i.z)] = i.x % 8 == 3 && i.y % 7 == 2 && i.z / 9 == 1;
  });
  return mask;
}

MotionPlan plan_of(const Grid& grid, const std::string& preset = "balanced") {
  return plan_motion(grid, *motion_preset(preset));
}

TEST(Region, OfAMaskThatIsFullIsEverything) {
  const Grid grid = plain_grid({70, 50, 90}, {1.0, 1.0, 2.0});
  const MotionPlan plan = plan_of(grid);
  const Region whole = whole_region(plan);
  const Region full = region_of(plan, box_mask(grid, glm::ivec3(0), grid.size));
  EXPECT_FALSE(whole.masked());
  EXPECT_TRUE(full.masked());
  EXPECT_TRUE(std::isinf(full.reach_mm));
  for (size_t l = 0; l < plan.levels.size(); ++l) {
    EXPECT_EQ(full.levels[l].bricks, all_bricks(plan.levels[l].cells));
    EXPECT_EQ(full.levels[l].bricks, whole.levels[l].bricks);
    EXPECT_EQ(full.levels[l].voxels.begin, glm::ivec3(0));
    EXPECT_EQ(full.levels[l].voxels.end, plan.levels[l].image_size);
  }
}

/// On each level: for each voxel that counts, the 27 cells from which its motion is interpolated
/// are in listed bricks; and each listed brick contains such a cell.
TEST(Region, WorksOnTheBricksThatCountingVoxelsReadAndNoOthers) {
  const Grid grid = plain_grid({150, 90, 100}, {1.0, 1.0, 1.5});
  const MotionPlan plan = plan_of(grid);
  // A box that ends at a brick's last cell, and one that begins at a brick's first cell.
  for (const Mask& mask : {box_mask(grid, {62, 30, 5}, {64, 60, 40}),
                           box_mask(grid, {96, 34, 66}, {99, 40, 70}), scattered_mask(grid)}) {
    const Region region = region_of(plan, mask);
    ASSERT_EQ(region.levels.size(), plan.levels.size());
    for (size_t l = 0; l < plan.levels.size(); ++l) {
      SCOPED_TRACE(l);
      const LevelPlan& level = plan.levels[l];
      const LevelRegion& part = region.levels[l];
      std::set<uint32_t> read;
      size_t at = 0;
      oracle::for_each(level.image_size, [&](glm::ivec3 voxel) {
        if (part.mask[at++] == 0) return;
        for (int k = 0; k < 27; ++k) {
          const glm::ivec3 cell = voxel / level.cell + glm::ivec3(k % 3, k / 3 % 3, k / 9) - 1;
          const glm::ivec3 b = glm::clamp(cell, glm::ivec3(0), level.cells - 1) / shaders::kBrick;
          read.insert(uint32_t(b.x) | uint32_t(b.y) << 10 | uint32_t(b.z) << 20);
        }
      });
      EXPECT_EQ(std::set<uint32_t>(part.bricks.begin(), part.bricks.end()), read);
      EXPECT_EQ(part.bricks.size(), read.size());
    }
    EXPECT_LT(region.levels[0].bricks.size(), all_bricks(plan.levels[0].cells).size() / 2);
  }
}

TEST(Region, PreparesTheBricksAndAsFarAroundAsThingsMayMove) {
  const Grid grid = plain_grid({256, 100, 160}, {1.0, 1.0, 2.0});
  for (const double search_mm : {0.0, 24.0}) {
    MotionOptions options = *motion_preset("balanced");
    options.search_mm = search_mm;
    const MotionPlan plan = plan_motion(grid, options);
    const Region region = region_of(plan, box_mask(grid, {130, 40, 70}, {150, 60, 75}));
    EXPECT_DOUBLE_EQ(region.reach_mm, search_mm > 0.0 ? 24.0 : 8.0);
    for (size_t l = 0; l < plan.levels.size(); ++l) {
      const LevelPlan& level = plan.levels[l];
      const VoxelBox& box = region.levels[l].voxels;
      for (const uint32_t brick : region.levels[l].bricks) {
        const glm::ivec3 begin = unpacked(brick) * level.cell * shaders::kBrick;
        const glm::ivec3 end = glm::min(begin + level.cell * shaders::kBrick, level.image_size);
        for (int a = 0; a < 3; ++a) {
          const double reach = region.reach_mm / level.spacing_mm[a];
          EXPECT_LE(box.begin[a], std::max(0.0, begin[a] - reach - 2.0));
          EXPECT_GE(box.end[a], std::min(double(level.image_size[a]), end[a] + reach + 2.0));
        }
      }
    }
    EXPECT_LT(region.levels[0].voxels.size().x, grid.size.x / 2);
    const Region wide = with_whole_images(plan, region);
    EXPECT_TRUE(std::isinf(wide.reach_mm));
    EXPECT_EQ(wide.levels[0].voxels.end, grid.size);
    EXPECT_EQ(wide.levels[0].bricks, region.levels[0].bricks);
  }
}

TEST(Region, OfAMaskThatVanishesOnACoarseLevelIsNothingThere) {
  const Grid grid = plain_grid({96, 96, 96});
  const MotionPlan plan = plan_of(grid);
  const Region region = region_of(plan, box_mask(grid, {40, 40, 40}, {41, 41, 41}));
  EXPECT_FALSE(region.levels.front().bricks.empty());
  EXPECT_TRUE(region.levels.back().bricks.empty());
  EXPECT_TRUE(region.levels.back().voxels.empty());
}

TEST(Region, KeepsWholeImagesForClassicAndForSlabs) {
  const Grid grid = plain_grid({128, 96, 96});
  const Mask mask = box_mask(grid, {10, 10, 10}, {20, 20, 20});
  const MotionPlan classic = plan_of(grid, "classic");
  const Region all = region_of(classic, mask);
  EXPECT_EQ(all.levels[0].bricks, all_bricks(classic.levels[0].cells));
  EXPECT_EQ(all.levels[0].voxels.end, grid.size);
  EXPECT_TRUE(all.masked());

  MotionPlan cut = plan_of(grid);
  ASSERT_TRUE(fit_into(cut, {cut.device_bytes / 2}));
  ASSERT_GT(cut.slabs, 1);
  const Region slabs = region_of(cut, mask);
  EXPECT_EQ(slabs.levels[0].voxels.end, grid.size);
  EXPECT_TRUE(std::isinf(slabs.reach_mm));
  EXPECT_EQ(slabs.levels[0].bricks.size(), 1U);
}

}  // namespace
}  // namespace palpate::test
