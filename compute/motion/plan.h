#pragma once

#include <cstdint>
#include <vector>

#include "compute/motion/options.h"

namespace palpate {

/// One level of the pyramid, as the plan lays it out.
struct LevelPlan {
  double h_mm = 1.0;         ///< the level's voxel edge
  glm::ivec3 image_size{0};  ///< voxels
  glm::dvec3 spacing_mm{1.0};
  glm::ivec3 ratio{1};  ///< voxels of the next finer level per voxel, per axis
  glm::ivec3 cell{1};   ///< voxels per field cell
  glm::ivec3 cells{0};  ///< size of the field
  glm::dvec3 cell_mm{1.0};
  glm::ivec3 moment_cell{1};  ///< voxels per cell of the local moments
  glm::ivec3 moment_cells{0};
  LevelOptions options;
};

/// What will be computed and what it takes, known before any work: levels[0] is the finest that is
/// solved on.
struct MotionPlan {
  Grid image;  ///< the frames' grid
  std::vector<LevelPlan> levels;
  Grid field;                 ///< grid of the result
  uint64_t device_bytes = 0;  ///< peak on the device for one pair
  uint64_t image_bytes = 0;  ///< part of it that scales with image voxels and can be cut into slabs
  MotionOptions options;
};

/// Lays out the levels for frames on `image`. Pure arithmetic, any thread.
MotionPlan plan_motion(const Grid& image, const MotionOptions& options);

/// Grid in physical space of a level's images and of its field.
Grid level_grid(const MotionPlan& plan, size_t level);
Grid field_grid(const MotionPlan& plan, size_t level);

}  // namespace palpate
