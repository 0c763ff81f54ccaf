#include "tests/lab/studies/motion_work.h"

#include <cmath>

namespace palpate::studies {
namespace {

constexpr double kBrickCells = 512.0;
constexpr double kBytesPerVoxel = 16.0, kBytesPerHalfVoxel = 12.0, kClassicBytes = 144.0;
constexpr double kBytesPerCell = 336.0, kBytesPerFilterStep = 120.0;
constexpr double kBytesPerLabel = 72.0;

const LevelPlan* level_of(const MotionPlan& plan, double h_mm) {
  for (const LevelPlan& level : plan.levels)
    if (std::abs(level.h_mm - h_mm) < 1e-9 * h_mm) return &level;
  return nullptr;
}

}  // namespace

double work_bytes(const MotionPlan& plan, const SolveReport& report) {
  const bool classic = plan.options.method == MotionMethod::kClassic;
  double bytes = 0.0;
  for (const LevelReport& done : report.levels) {
    const LevelPlan* level = level_of(plan, done.h_mm);
    if (!level) continue;
    const double voxels = double(level->cell.x) * level->cell.y * level->cell.z;
    const double per_voxel = plan.options.checkerboard ? kBytesPerHalfVoxel : kBytesPerVoxel;
    const double per_cell =
        classic
            ? kClassicBytes
            : kBytesPerCell + kBytesPerFilterStep * plan.options.filter_steps + per_voxel * voxels;
    bytes += done.brick_iterations * kBrickCells * per_cell + done.searched * kBytesPerLabel;
  }
  return bytes;
}

}  // namespace palpate::studies
