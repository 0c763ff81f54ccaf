#include "compute/motion/plan.h"

#include <algorithm>
#include <cmath>

#include "compute/motion/activity.h"

namespace palpate {
namespace {

// voxels: wide enough for structure, narrow enough that any motion is a few voxels
constexpr int kCoarsestWidth = 24;
constexpr int kNodeVoxels = 2;         // voxels per node along each axis
constexpr size_t kFinestSearched = 2;  // level after which the discrete start still searches
constexpr int kSmallestCells = 2;      // a field needs a neighbour to be smooth with

int longest(glm::ivec3 v) {
  return std::max(v.x, std::max(v.y, v.z));
}

glm::ivec3 cells_of(glm::ivec3 size, glm::ivec3 cell) {
  return (size + cell - 1) / cell;
}

/// Voxels per cell along each axis: the power of two up to `cell` whose edge is nearest to cell x
/// h, so that cells are nearly isotropic for any voxels. At least two cells along an axis that is
/// divided at all.
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

/// Cells of the local moments are much smaller than their window, so that they do not change the
/// result.
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

/// Slabs begin at a multiple of this: where a cell of the local moments and a voxel of the next
/// level begin.
int slab_unit(const MotionPlan& plan) {
  return 2 * plan.levels[0].moment_cell.z;
}

int slab_slices(const MotionPlan& plan) {
  if (plan.slabs <= 1) return plan.image.size.z;
  const int unit = slab_unit(plan);
  const int even = (plan.image.size.z + plan.slabs - 1) / plan.slabs;
  return (even + unit - 1) / unit * unit;
}

/// Bytes of an image with `texel` bytes per texel. Drivers pad rows to a cache line and slices to
/// four rows.
uint64_t image_bytes(glm::ivec3 size, uint64_t texel) {
  const uint64_t row = (uint64_t(size.x) * texel + 63) / 64 * 64;
  return row * uint64_t((size.y + 3) / 4 * 4) * uint64_t(size.z);
}

/// Bytes for intensities, normalised intensities, mask and two sets of moments.
uint64_t workspace_bytes(glm::ivec3 size, glm::ivec3 moment_cell) {
  return 2 * image_bytes(size, 2) + image_bytes(size, 1) +
         2 * image_bytes(cells_of(size, moment_cell), 8);
}

}  // namespace

bool yields(const MotionPlan& plan, size_t l) {
  const double window = plan.options.yield.window;
  return plan.options.method == MotionMethod::kPalpate && l == 0 &&
         plan.options.finest_level == 0 && plan.levels.size() > 1 && window > 0.0 &&
         window < plan.levels[0].options.window;
}

bool has_sliding_step(const MotionPlan& plan) {
  return plan.options.method == MotionMethod::kPalpate && plan.options.finest_level == 0 &&
         plan.slabs == 1 && plan.options.sliding.cell > 0;
}

LevelPlan result_level(const MotionPlan& plan) {
  LevelPlan level = plan.levels[size_t(plan.options.finest_level)];
  if (!has_sliding_step(plan)) return level;
  level.cell = glm::min(level.cell, cell_along(level.spacing_mm, level.h_mm,
                                               plan.options.sliding.cell, level.image_size));
  level.cells = cells_of(level.image_size, level.cell);
  level.cell_mm = level.spacing_mm * glm::dvec3(level.cell);
  return level;
}

uint64_t solver_bytes(const MotionPlan& plan) {
  const bool classic = plan.options.method == MotionMethod::kClassic;
  uint64_t bytes = 0;
  for (size_t l = size_t(plan.options.finest_level); l < plan.levels.size(); ++l) {
    const LevelPlan& level = plan.levels[l];
    // Images of PairSolver::LevelImages and ClassicSolver::LevelImages.
    if (yields(plan, l)) bytes += sizeof(uint64_t) * count(plan.levels[l + 1].cells);
    bytes += classic ? 2 * image_bytes(level.image_size, 16)
                     : 4 * image_bytes(level.cells, 16) +
                           (yields(plan, l) ? 15 : 11) * image_bytes(level.cells, 8);
    if (level.options.second > 0.0) bytes += 6 * image_bytes(level.cells, 8);
    if (yields(plan, l) && plan.options.yield.choose_after > 0)
      bytes += 2 * image_bytes(level.cells, 16) + 5 * image_bytes(level.cells, 8);
  }
  // PairSolver: what is measured in each brick.
  if (!classic) {
    uint64_t bricks = 0;
    for (const LevelPlan& level : plan.levels)
      bricks = std::max(bricks, count(brick_count(level.cells)));
    bytes += bricks * sizeof(BrickMeasure);
  }
  // SlidingBorders.
  if (has_sliding_step(plan)) {
    const LevelPlan fine = result_level(plan);
    bytes += 2 * image_bytes(fine.cells, 16) + 3 * image_bytes(fine.cells, 8) +
             2 * image_bytes(plan.levels[0].cells, 16);
  }
  // DiscreteStart: costs of one search at a time.
  uint64_t costs = 0;
  for (const SearchPlan& search : plan_searches(plan)) {
    bytes += 4 * image_bytes(search.nodes, 16) + 2 * sizeof(uint32_t) * search.count();
    const double most = double(search.count()) * SearchPlan::labels(search.most);
    costs = std::max(costs, 2 * sizeof(float) * uint64_t(std::min(most, search.work)));
  }
  bytes += costs;
  return bytes;
}

namespace {

/// What the engine allocates on the device, image by image.
uint64_t bytes_needed(const MotionPlan& plan) {
  const uint64_t pyramids = plan.cyclic ? 3 : 2;  // fixed, moving, and the first frame of a cycle
  uint64_t bytes = solver_bytes(plan);
  for (size_t l = 0; l < plan.levels.size(); ++l) {
    const LevelPlan& level = plan.levels[l];
    const bool solved = int(l) >= plan.options.finest_level;
    if (l == 0 && plan.slabs > 1) {
      // Two slabs for the data term, what they are made of, and one with its halo while it is
      // prepared.
      glm::ivec3 slab = level.image_size;
      slab.z = slabs_of(plan).front().depth;
      bytes += 2 * image_bytes(slab, 8) + image_bytes(slab, 2) + image_bytes(slab, 1);
      slab.z =
          std::min(level.image_size.z, slab.z + 2 * normalisation_halo(plan) + level.moment_cell.z);
      bytes += workspace_bytes(slab, level.moment_cell);
    } else {
      bytes += workspace_bytes(level.image_size, level.moment_cell);
      if (l == 0 && has_sliding_step(plan))
        bytes += (pyramids - 1) * image_bytes(level.image_size, 2);
      if (solved) bytes += pyramids * image_bytes(level.image_size, 8);
    }
  }
  return bytes + bytes / 50;  // 2 % for the alignment of single allocations
}

/// What frames keep on the host, as halves.
uint64_t slab_bytes(const MotionPlan& plan) {
  if (plan.slabs == 1) return 0;
  uint64_t slices = 0;
  for (const Slab& slab : slabs_of(plan)) slices += uint64_t(slab.depth);
  const glm::ivec3 size = plan.image.size;
  return (plan.cyclic ? 3 : 2) * slices * uint64_t(size.x) * uint64_t(size.y) * 2;
}

uint64_t largest_image_of(const MotionPlan& plan) {
  glm::ivec3 finest = plan.image.size;
  if (plan.slabs > 1) finest.z = slabs_of(plan).front().depth;
  uint64_t largest = plan.options.finest_level > 0 ? 0 : image_bytes(finest, 8);
  for (size_t l = size_t(std::max(1, plan.options.finest_level)); l < plan.levels.size(); ++l)
    largest = std::max(largest, image_bytes(plan.levels[l].image_size, 8));
  return largest;
}

/// Everything that depends on the number of slabs; the step for sliding borders needs whole images.
void lay_out(MotionPlan& plan, int slabs) {
  plan.slabs = slabs;
  plan.field =
      coarsened(level_grid(plan, size_t(plan.options.finest_level)), result_level(plan).cell);
  plan.device_bytes = bytes_needed(plan);
  plan.host_bytes = slab_bytes(plan);
  plan.largest_image_bytes = largest_image_of(plan);
}

}  // namespace

MotionPlan plan_motion(const Grid& image, const MotionOptions& options, bool cyclic) {
  MotionPlan plan;
  plan.image = image;
  plan.options = options;
  plan.cyclic = cyclic;
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
      // Shrink only towards isotropic voxels: an axis stays until h is as large as its spacing.
      if (2.0 * level.spacing_mm[a] <= 1.42 * level.h_mm && level.image_size[a] >= 8)
        level.ratio[a] = 2;
    }
    if (level.ratio == glm::ivec3(1) && longest(level.image_size) < 8) break;
    level.image_size = (level.image_size + level.ratio - 1) / level.ratio;
    level.spacing_mm *= glm::dvec3(level.ratio);
  }
  plan.levels = all;

  lay_out(plan, 1);
  return plan;
}

std::vector<Slab> slabs_of(const MotionPlan& plan) {
  const int nz = plan.image.size.z;
  const int owned = slab_slices(plan);
  std::vector<Slab> slabs;
  for (int begin = 0; begin < nz; begin += owned) {
    Slab slab;
    slab.begin = begin;
    slab.end = std::min(nz, begin + owned);
    slab.depth = std::min(nz, owned + 3);
    slab.first = std::clamp(begin - 1, 0, nz - slab.depth);
    slabs.push_back(slab);
  }
  return slabs;
}

int normalisation_halo(const MotionPlan& plan) {
  const LevelPlan& level = plan.levels[0];
  const double cell_mm = level.spacing_mm.z * level.moment_cell.z;
  const int reach = int(std::ceil(3.0 * plan.options.normalise_window * level.h_mm / cell_mm)) + 2;
  return reach * level.moment_cell.z;
}

bool fit_into(MotionPlan& plan, const MemoryBudget& budget) {
  lay_out(plan, 1);
  const auto fits = [&] {
    return plan.device_bytes <= budget.device_bytes &&
           plan.device_bytes + plan.host_bytes <= budget.both_bytes &&
           plan.largest_image_bytes <= budget.largest_image_bytes;
  };
  // Whole images without the step for sliding borders are better than slabs, which can not have it.
  if (!fits() && has_sliding_step(plan)) {
    plan.options.sliding.cell = 0;
    lay_out(plan, 1);
  }
  while (!fits()) {
    const int before = slab_slices(plan);
    // The classic solver keeps whole images, and a single level has no coarser one to start from.
    const bool whole = plan.options.method == MotionMethod::kClassic || plan.levels.size() < 2 ||
                       plan.options.finest_level > 0;
    if (whole || before <= slab_unit(plan)) return false;
    int slabs = plan.slabs;
    while (slab_slices(plan) == before) plan.slabs = ++slabs;
    lay_out(plan, slabs);
  }
  return true;
}

glm::ivec3 SearchPlan::reach_for(size_t searched) const {
  const double h = std::min({spacing_mm.x, spacing_mm.y, spacing_mm.z});
  for (int voxels = std::max({most.x, most.y, most.z}); voxels >= 2; --voxels) {
    const glm::ivec3 reach = glm::min(most, glm::ivec3(glm::floor(voxels * h / spacing_mm + 0.5)));
    if (double(searched) * labels(reach) <= work) return reach;
  }
  return glm::ivec3(0);
}

std::vector<SearchPlan> plan_searches(const MotionPlan& plan) {
  std::vector<SearchPlan> all;
  if (plan.options.search_mm <= 0.0 || plan.options.method == MotionMethod::kClassic) return all;
  // Not after the two finest levels: they have many nodes, and level 2 already explains what they
  // could.
  const size_t finest = std::max(size_t(plan.options.finest_level) + 1,
                                 std::min<size_t>(kFinestSearched, plan.levels.size() - 1));
  for (size_t l = plan.levels.size(); l-- > finest;) {
    const LevelPlan& level = plan.levels[l];
    SearchPlan search;
    search.level = l;
    search.spacing_mm = level.spacing_mm;
    search.work = plan.options.search_work / (kNodeVoxels * kNodeVoxels * kNodeVoxels);
    for (int a = 0; a < 3; ++a) {
      search.cell[a] = level.image_size[a] >= 2 * kNodeVoxels ? kNodeVoxels : 1;
      // Not further than half the image: what moves more has left it.
      search.most[a] = std::min(
          int(std::floor(plan.options.search_reach * level.h_mm / level.spacing_mm[a] + 0.5)),
          level.image_size[a] / 2);
    }
    search.nodes = (level.image_size + search.cell - 1) / search.cell;
    if (search.reach_for(1) != glm::ivec3(0)) all.push_back(search);
  }
  return all;
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
