#include "compute/motion/plan.h"

#include <algorithm>

namespace palpate {
namespace {

constexpr int kCoarsestWidth =
    24;  // voxels: wide enough for structure, narrow enough that any motion is a few voxels
constexpr int kSmallestCells = 2;  // a field needs a neighbour to be smooth with

int longest(glm::ivec3 v) {
  return std::max(v.x, std::max(v.y, v.z));
}

glm::ivec3 cells_of(glm::ivec3 size, glm::ivec3 cell) {
  return (size + cell - 1) / cell;
}

/// Voxels per cell along each axis: the power of two up to `cell` that comes nearest to an edge of
/// cell x h, so that cells are near isotropic whatever the voxels are. Two cells at least along an
/// axis that is cut at all.
glm::ivec3 cell_along(glm::dvec3 spacing_mm, double h_mm, int cell, glm::ivec3 size) {
  glm::ivec3 result(1);
  for (int a = 0; a < 3; ++a) {
    while (2 * result[a] <= cell && 2.0 * result[a] * spacing_mm[a] <= 1.42 * cell * h_mm &&
           size[a] >= kSmallestCells * 2 * result[a]) {
      result[a] *= 2;
    }
  }
  return result;
}

/// Cells of the local moments are a good deal smaller than their window, so that they do not change
/// it.
void lay_out_cells(LevelPlan& level, double normalise_window) {
  const int moment_cell = normalise_window >= 3.0 ? 4 : 2;
  level.cell = cell_along(level.spacing_mm, level.h_mm, level.options.cell, level.image_size);
  level.cells = cells_of(level.image_size, level.cell);
  level.cell_mm = level.spacing_mm * glm::dvec3(level.cell);
  level.moment_cell = cell_along(level.spacing_mm, level.h_mm, moment_cell, level.image_size);
  level.moment_cells = cells_of(level.image_size, level.moment_cell);
}

uint64_t count(glm::ivec3 v) {
  return uint64_t(v.x) * uint64_t(v.y) * uint64_t(v.z);
}

}  // namespace

MotionPlan plan_motion(const Grid& image, const MotionOptions& options) {
  MotionPlan plan;
  plan.image = image;
  plan.options = options;
  LevelPlan level;
  level.h_mm = image.finest_mm();
  level.image_size = image.size;
  level.spacing_mm = image.spacing_mm;
  std::vector<LevelPlan> all;
  for (size_t l = 0;; ++l) {
    level.options = options.levels[std::min(l, options.levels.size() - 1)];
    lay_out_cells(level, options.normalise_window);
    all.push_back(level);
    const bool enough = options.coarse_levels > 0 ? int(l) + 1 >= options.coarse_levels
                                                  : longest(level.image_size) <= kCoarsestWidth;
    if (enough) break;
    level.h_mm *= 2.0;
    level.ratio = glm::ivec3(1);
    for (int a = 0; a < 3; ++a) {
      // Shrink only towards isotropic voxels: an axis waits until h has caught up with it.
      if (2.0 * level.spacing_mm[a] <= 1.42 * level.h_mm && level.image_size[a] >= 8)
        level.ratio[a] = 2;
    }
    if (level.ratio == glm::ivec3(1) && longest(level.image_size) < 8) break;
    level.image_size = (level.image_size + level.ratio - 1) / level.ratio;
    level.spacing_mm *= glm::dvec3(level.ratio);
  }
  plan.levels = all;

  // Per pair: packed images (8 bytes) of both frames on every level, one level's scratch and one
  // level's field data.
  uint64_t field_bytes = 0;
  for (const LevelPlan& l : plan.levels) {
    plan.image_bytes += 2 * 8 * count(l.image_size);
    field_bytes = std::max(field_bytes, count(l.cells));
  }
  plan.image_bytes += 2 * 2 * count(image.size);
  plan.device_bytes = plan.image_bytes + 200 * field_bytes;
  plan.field = field_grid(plan, size_t(options.finest_level));
  return plan;
}

Grid level_grid(const MotionPlan& plan, size_t level) {
  Grid grid = plan.image;
  for (size_t l = 1; l <= level; ++l) {
    grid = coarsened(grid, plan.levels[l].ratio);
  }
  return grid;
}

Grid field_grid(const MotionPlan& plan, size_t level) {
  return coarsened(level_grid(plan, level), plan.levels[level].cell);
}

}  // namespace palpate
