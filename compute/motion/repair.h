#pragma once

#include "compute/motion/bricks.h"
#include "compute/motion/kernels.h"
#include "compute/motion/plan.h"
#include "compute/motion/report.h"
#include "compute/vulkan/recorder.h"

namespace palpate {

/// What repair_folds() works on: images and lists of one field.
struct FoldRepair {
  vulkan::Image& field;        ///< u in mm along the image axes; the result
  vulkan::Image& other;        ///< of the same size, to work in
  const vulkan::Image& flags;  ///< likewise
  vulkan::Buffer& list;        ///< room for all bricks of the field
  vulkan::Buffer& counts;      ///< a number for each of them
};

/// Smooths a field on a level's cells where it folds until it folds nowhere. The first `along`
/// rounds smooth along the field's jumps only, which keeps borders that slide; the others in all
/// directions, which always ends. `looked_at`, sorted: the bricks that may fold; outside them both
/// images hold the same, and flags are 0. Throws vulkan::Failure.
void repair_folds(vulkan::Recorder& recorder, MotionKernels& kernels, const LevelPlan& level,
                  double min_determinant, int along, const FoldRepair& repair, BrickList looked_at,
                  SolveReport& report);

}  // namespace palpate
