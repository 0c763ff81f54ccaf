#pragma once

#include "compute/motion/plan.h"
#include "compute/motion/report.h"

namespace palpate::studies {

/// Bytes that an estimation moved, counted from its iterations: the same on every machine, so that
/// settings can be compared without a clock. Each texel that a kernel needs counts once. Per
/// iteration: 16 bytes per image voxel (a texel of each frame; 12 if half the voxels of fixed are
/// read alternately). Also, per field cell, 336 (field, equations written, 3 passes of the window
/// over them, step, result; a fifth of a measurement of the bricks) and 120 per filter step.
/// classic: 144 per voxel (two texels, the field, 3 passes of a Gaussian over it). The discrete
/// start moves 72 per node and label (8 voxels of two images in half precision, 10 passes over
/// costs). The preparation of frames is the same for all settings and not included.
double work_bytes(const MotionPlan& plan, const SolveReport& report);

}  // namespace palpate::studies
