#pragma once

#include <cstdint>
#include <vector>

#include "compute/motion/options.h"

namespace palpate {

/// One level of the pyramid.
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

/// Layout, work and memory of an estimation, known before it starts. levels[0] has the voxels
/// of the frames; the finest level that is solved is levels[options.finest_level].
struct MotionPlan {
  Grid image;  ///< the frames' grid
  std::vector<LevelPlan> levels;
  Grid field;                        ///< grid of the result, see result_level()
  bool cyclic = false;               ///< the first frame stays on the device, for the last pair
  uint64_t device_bytes = 0;         ///< peak on the device while pairs are solved
  uint64_t host_bytes = 0;           ///< what slabs keep on the host
  uint64_t largest_image_bytes = 0;  ///< of the images of frames
  /// pieces along k into which the finest images are cut; more than 1: kept on the host
  int slabs = 1;
  MotionOptions options;
};

/// Whether level l uses two windows (MotionOptions::yield): the finest of several levels, unless
/// its window is narrow enough.
bool yields(const MotionPlan& plan, size_t l);

/// Whether pairs end with the step for sliding borders (MotionOptions::sliding). Not where
/// fit_into() had to leave it out, nor where the finest images are cut into slabs.
bool has_sliding_step(const MotionPlan& plan);

/// The finest level with the cells of the result: its own, or those of the step for
/// sliding borders.
LevelPlan result_level(const MotionPlan& plan);

/// Lays out the levels for frames on `image`; `cyclic`: of a cycle, whose last frame is followed by
/// the first. Pure arithmetic, any thread.
MotionPlan plan_motion(const Grid& image, const MotionOptions& options, bool cyclic = false);

/// What a solver of the plan allocates on the device beside the frames, bytes.
uint64_t solver_bytes(const MotionPlan& plan);

/// Memory in which a plan has to fit.
struct MemoryBudget {
  uint64_t device_bytes = 0;
  uint64_t largest_image_bytes = UINT64_MAX;
  uint64_t both_bytes = UINT64_MAX;  ///< on the device and the host together
};

/// Makes the work fit. First without the step for sliding borders, then with the finest images cut
/// into as few slabs as possible, which are kept on the host and copied to the device one by one.
/// False if even the thinnest slabs do not fit.
bool fit_into(MotionPlan& plan, const MemoryBudget& budget);

/// One piece of the finest images. It computes slices [begin, end) and contains slices [first,
/// first + depth): at least one more before and two more after, up to the border of the image. A
/// sample between slices reads the one after, whose gradient reads the one after that.
struct Slab {
  int begin = 0, end = 0, first = 0, depth = 0;
};
std::vector<Slab> slabs_of(const MotionPlan& plan);

/// Slices on each side of a slab that local normalisation needs to give the same as in the whole
/// image.
int normalisation_halo(const MotionPlan& plan);

/// Where the discrete start searches after a level, and over which displacements.
struct SearchPlan {
  size_t level = 0;    ///< the level of the pyramid whose images are compared
  glm::ivec3 cell{1};  ///< voxels per node
  glm::ivec3 nodes{0};
  glm::dvec3 spacing_mm{1.0};  ///< of the level
  glm::ivec3 most{0};          ///< largest displacement of a label along each axis, voxels
  double work = 0.0;           ///< number of nodes times labels that may be tried

  size_t count() const { return size_t(nodes.x) * size_t(nodes.y) * size_t(nodes.z); }
  static int labels(glm::ivec3 reach) {
    return (2 * reach.x + 1) * (2 * reach.y + 1) * (2 * reach.z + 1);
  }
  /// The largest reach, at most `most`, with which `searched` nodes can be searched within `work`;
  /// 0 if that is less than two voxels of the finest axis.
  glm::ivec3 reach_for(size_t searched) const;
};

/// The searches of a plan, coarsest first: after each level from the coarsest to the third finest,
/// or after the second if there are only two; none if the search is off.
std::vector<SearchPlan> plan_searches(const MotionPlan& plan);

/// Grid in physical space (LPS mm) of a level's images, and of its field.
Grid level_grid(const MotionPlan& plan, size_t level);
Grid field_grid(const MotionPlan& plan, size_t level);

}  // namespace palpate
