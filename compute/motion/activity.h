#pragma once

#include <span>

#include "compute/motion/bricks.h"

namespace palpate {

/// What the device saw in one brick (measure.comp).
struct BrickMeasure {
  float moved = 0.0F;      ///< largest change of the field since the last look, in h
  float structure = 0.0F;  ///< largest mean squared normalised intensity; 0: no voxel counted
  float reach = 0.0F;      ///< largest |u|, in h
};

/// When a brick may rest.
struct RestRule {
  double moved = 0.0;      ///< it and its neighbours moved less than this, in h; or
  double structure = 0.0;  ///< its images have less structure than this and
  /// nothing in it has left its place by more than this, in h: empty and still
  double reach = 0.25;
};

/// The bricks that still need work, order kept. A flat brick that has moved stays in work: the
/// filter carries the motion of its borders through it, as through a liver without contrast.
/// `bricks` and `looks` run in parallel; `cells` is the field's size.
BrickList active_bricks(const BrickList& bricks, std::span<const BrickMeasure> measures,
                        glm::ivec3 cells, const RestRule& rule);

}  // namespace palpate
