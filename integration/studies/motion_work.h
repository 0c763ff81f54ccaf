#pragma once

#include "compute/motion/plan.h"
#include "compute/motion/report.h"

namespace palpate::studies {

/// Bytes that an estimation moved, counted from what was iterated: the same on every machine, so
/// that settings can be compared without a clock. Per iteration and brick 5 bytes per image voxel
/// that is read and 340 per field cell (classic, with a vector per voxel: 345); the discrete start
/// moves 72 per node and label (8 voxels of two images in half precision, 10 passes over costs).
/// Preparing the frames costs every setting the same and is not in it.
double work_bytes(const MotionPlan& plan, const SolveReport& report);

}  // namespace palpate::studies
