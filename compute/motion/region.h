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

/// What there is to do on one level of the pyramid.
struct LevelRegion {
  std::vector<uint8_t> mask;  ///< of the level's voxels, 255 where one counts; empty: all do
  BrickList bricks;           ///< of the field: those with a cell that a counting voxel reads
  VoxelBox voxels;  ///< of the images: what those bricks hold, and as far around as things move
};

/// What a mask leaves of the work, known before it starts.
struct Region {
  std::vector<LevelRegion> levels;  ///< as the plan's
  /// Motion up to which the boxes of voxels are wide enough, in mm; infinite where they are whole.
  double reach_mm = std::numeric_limits<double>::infinity();
  bool masked() const { return !levels.empty() && !levels.front().mask.empty(); }
};

/// Everything counts.
Region whole_region(const MotionPlan& plan);

/// Only the mask's voxels count, on a coarser level those of which most lies inside. The field is
/// worked on in the bricks that hold a counting voxel's cell or a neighbour of it, since motion is
/// interpolated; elsewhere it keeps what coarser levels say. Images are prepared around these
/// bricks as far as options.search_mm (8 voxels at least): classic reads, and slabs hold, whole
/// ones. The mask lies on the plan's grid. Pure arithmetic, any thread.
Region region_of(const MotionPlan& plan, const Mask& mask);

/// The same region with whole images, for motion beyond reach_mm.
Region with_whole_images(const MotionPlan& plan, Region region);

}  // namespace palpate
