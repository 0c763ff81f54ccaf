#include "compute/motion/region.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace palpate {
namespace {

constexpr double kLeastReach = 8.0;  // voxels of the finest level
/// Voxels beyond the reach: one for a trilinear sample, one for the momentum, which samples ahead,
/// one for rounding.
constexpr int kSlack = 3;

size_t offset(glm::ivec3 i, glm::ivec3 size) {
  return size_t(i.x) + size_t(size.x) * (size_t(i.y) + size_t(size.y) * size_t(i.z));
}

/// A coarse voxel is inside if most of what it covers is.
std::vector<uint8_t> shrunk_mask(const std::vector<uint8_t>& fine, glm::ivec3 fine_size,
                                 glm::ivec3 ratio, glm::ivec3 size) {
  std::vector<uint8_t> coarse(size_t(size.x) * size_t(size.y) * size_t(size.z));
  size_t out = 0;
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x, ++out) {
        int inside = 0, all = 0;
        for (int k = 0; k < ratio.x * ratio.y * ratio.z; ++k) {
          const glm::ivec3 i =
              glm::ivec3(x, y, z) * ratio +
              glm::ivec3(k % ratio.x, k / ratio.x % ratio.y, k / (ratio.x * ratio.y));
          if (i.x >= fine_size.x || i.y >= fine_size.y || i.z >= fine_size.z) continue;
          ++all;
          inside += fine[offset(i, fine_size)] != 0;
        }
        coarse[out] = 2 * inside >= all ? 255 : 0;
      }
    }
  }
  return coarse;
}

VoxelBox whole_box(const LevelPlan& level) {
  return {glm::ivec3(0), level.image_size};
}

/// The bricks that hold a cell of a counting voxel, or a neighbour of such a cell.
BrickList read_bricks(const LevelPlan& level, const std::vector<uint8_t>& mask) {
  const glm::ivec3 n = brick_count(level.cells);
  std::vector<bool> read(size_t(n.x) * size_t(n.y) * size_t(n.z), false);
  // Each cell is marked once per row of voxels: most voxels lie in the cell of the voxel before.
  const glm::ivec3 last = level.cells - 1;
  size_t at = 0;
  for (int z = 0; z < level.image_size.z; ++z) {
    for (int y = 0; y < level.image_size.y; ++y) {
      int before = -1;  // the last cell marked in this row
      for (int x = 0; x < level.image_size.x; ++x, ++at) {
        if (mask[at] == 0 || x / level.cell.x == before) continue;
        const glm::ivec3 cell = glm::ivec3(x, y, z) / level.cell;
        before = cell.x;
        const glm::ivec3 from = glm::max(cell - 1, glm::ivec3(0)) / shaders::kBrick;
        const glm::ivec3 to = glm::min(cell + 1, last) / shaders::kBrick;
        for (int k = from.z; k <= to.z; ++k)
          for (int j = from.y; j <= to.y; ++j)
            for (int i = from.x; i <= to.x; ++i) read[offset({i, j, k}, n)] = true;
      }
    }
  }
  BrickList bricks;
  for (const uint32_t brick : all_bricks(level.cells)) {
    if (read[offset(unpacked(brick), n)]) bricks.push_back(brick);
  }
  return bricks;
}

VoxelBox box_around(const LevelPlan& level, const BrickList& bricks, double reach_mm) {
  if (bricks.empty()) return {};
  VoxelBox box{level.image_size, glm::ivec3(0)};
  const glm::ivec3 edge = level.cell * shaders::kBrick;
  for (const uint32_t brick : bricks) {
    const glm::ivec3 begin = unpacked(brick) * edge;
    box.begin = glm::min(box.begin, begin);
    box.end = glm::max(box.end, begin + edge);
  }
  const glm::ivec3 margin = glm::ivec3(glm::ceil(reach_mm / level.spacing_mm)) + kSlack;
  return {glm::max(box.begin - margin, glm::ivec3(0)),
          glm::min(box.end + margin, level.image_size)};
}

}  // namespace

Region whole_region(const MotionPlan& plan) {
  Region region;
  for (const LevelPlan& level : plan.levels)
    region.levels.push_back({{}, all_bricks(level.cells), whole_box(level)});
  return region;
}

Region region_of(const MotionPlan& plan, const Mask& mask) {
  assert(mask.grid.size == plan.image.size && "the mask must have the plan's size");
  Region region = whole_region(plan);
  for (size_t l = 0; l < plan.levels.size(); ++l) {
    const LevelPlan& level = plan.levels[l];
    std::vector<uint8_t>& values = region.levels[l].mask;
    if (l == 0) {
      values = mask.values;
      for (uint8_t& value : values) value = value ? 255 : 0;
    } else {
      const LevelPlan& finer = plan.levels[l - 1];
      values =
          shrunk_mask(region.levels[l - 1].mask, finer.image_size, level.ratio, level.image_size);
    }
  }
  if (plan.options.method == MotionMethod::kClassic) return region;
  const double reach_mm = std::max(plan.options.search_mm, kLeastReach * plan.levels.front().h_mm);
  bool whole = true;
  for (size_t l = 0; l < plan.levels.size(); ++l) {
    LevelRegion& level = region.levels[l];
    level.bricks = read_bricks(plan.levels[l], level.mask);
    if (plan.slabs > 1) continue;
    level.voxels = box_around(plan.levels[l], level.bricks, reach_mm);
    whole &= level.voxels.size() == plan.levels[l].image_size;
  }
  if (!whole) region.reach_mm = reach_mm;
  return region;
}

Region with_whole_images(const MotionPlan& plan, Region region) {
  for (size_t l = 0; l < plan.levels.size(); ++l)
    region.levels[l].voxels = whole_box(plan.levels[l]);
  region.reach_mm = std::numeric_limits<double>::infinity();
  return region;
}

}  // namespace palpate
