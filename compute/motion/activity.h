#pragma once

#include <span>

#include "compute/motion/bricks.h"

namespace palpate {

/// What the device measured in one brick (measure.comp). Lengths in h, the level's voxel edge.
struct BrickMeasure {
  float moved = 0.0F;      ///< largest change of the field since the last measurement
  float structure = 0.0F;  ///< largest mean squared normalised intensity; 0: no voxel counted
  float reach = 0.0F;      ///< largest |u|
};

/// When a brick may rest (be left out of further iterations): (a), or (b) with both limits, or if
/// none of its voxels counted. Lengths in h.
struct RestRule {
  double moved = 0.0;      ///< (a) the brick and its neighbours moved less than this
  double structure = 0.0;  ///< (b) its mean squared normalised intensity is below this,
  double reach = 0.25;     ///< and every |u| in it is below this
};

/// The bricks that still need work, in their old order. A brick without structure that has moved
/// stays in work: the total variation carries the motion of its borders through it, as through a
/// liver without contrast. `measures` are those of `bricks`, in the same order; `cells` is the size
/// of the field.
BrickList active_bricks(const BrickList& bricks, std::span<const BrickMeasure> measures,
                        glm::ivec3 cells, const RestRule& rule);

}  // namespace palpate
