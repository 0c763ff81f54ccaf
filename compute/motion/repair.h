#pragma once

#include "compute/motion/bricks.h"
#include "compute/motion/kernels.h"
#include "compute/motion/plan.h"
#include "compute/motion/report.h"
#include "compute/vulkan/recorder.h"

namespace palpate {

/// Arguments of repair_folds(): images and lists of one field.
struct FoldRepair {
  vulkan::Image& field;        ///< u in mm along the image axes; the result
  vulkan::Image& other;        ///< of the same size, to work in
  const vulkan::Image& flags;  ///< of the same size
  vulkan::Buffer& list;        ///< room for all bricks of the field
  vulkan::Buffer& counts;      ///< one word for each of them
};

/// Smooths a field on a level's cells where it folds, until there are no folds. The first `along`
/// rounds straighten borders and smooth only along the jumps of the field, which keeps sliding
/// borders; the later ones smooth in all directions, which always ends. `looked_at`, sorted: the
/// bricks that may fold; outside them both images must be equal, and flags 0. Throws
/// vulkan::Failure.
void repair_folds(vulkan::Recorder& recorder, MotionKernels& kernels, const LevelPlan& level,
                  double min_determinant, int along, const FoldRepair& repair, BrickList looked_at,
                  SolveReport& report);

}  // namespace palpate
