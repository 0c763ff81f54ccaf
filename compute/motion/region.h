#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "compute/motion/bricks.h"
#include "compute/motion/plan.h"

namespace palpate {

/// Voxels [begin, end) along each axis; empty where end <= begin.
struct VoxelBox {
  glm::ivec3 begin{0}, end{0};
  glm::ivec3 size() const { return glm::max(end - begin, glm::ivec3(0)); }
  bool empty() const { return glm::any(glm::lessThanEqual(end, begin)); }
};

/// The part of one level of the pyramid that has to be computed.
struct LevelRegion {
  std::vector<uint8_t> mask;  ///< of the level's voxels: 255 where one counts; empty: all count
  BrickList bricks;  ///< of the field: those that contain a cell that a counting voxel reads
  /// of the images: those bricks, and as far around as things move
  VoxelBox voxels;
};

/// The part of the work that remains with a mask, known before it starts.
struct Region {
  std::vector<LevelRegion> levels;  ///< as the plan's
  /// Largest motion for which the boxes of voxels are wide enough, in mm; infinite for whole
  /// images.
  double reach_mm = std::numeric_limits<double>::infinity();
  bool masked() const { return !levels.empty() && !levels.front().mask.empty(); }
};

/// The region without a mask: everything counts.
Region whole_region(const MotionPlan& plan);

/// The region of a mask on the plan's grid; a coarser voxel counts if most of what it covers is
/// inside. The field is computed in the bricks that contain the cell of a counting voxel, or a
/// neighbour of that cell, since motion is interpolated; elsewhere it keeps the coarser level's
/// values. Images are prepared up to options.search_mm around these bricks (at least 8 voxels); for
/// the classic method and with slabs they are prepared whole. Pure arithmetic, any thread.
Region region_of(const MotionPlan& plan, const Mask& mask);

/// The same region with whole images, for motion larger than reach_mm.
Region with_whole_images(const MotionPlan& plan, Region region);

}  // namespace palpate
