#pragma once

#include <glm/glm.hpp>

#include "module/scene/motion_map.h"
#include "module/scene/scene_spec.h"
#include "module/scene/sequence_map.h"

namespace palpate {

/// The solution x of x + g (u(x) + closing) = target, and how good it is.
struct BackTrack {
  glm::dvec3 x_m{0.0};      ///< in the data frame, volume space
  double residual_m = 0.0;  ///< |x + g (u(x) + closing) - target|
  int steps = 0;            ///< field reads spent, less the first
  bool ok = false;          ///< residual small enough and no fold at x
  MotionSample at;          ///< the field at x_m
};

/// Equation (26): the place in the data frame of the material that is at `target` when the share
/// `phase` of the step to the next frame is done. Newton with the trilinear Jacobian, warm started
/// and safeguarded (a step that does not lower the residual is halved), within 16 steps; or the
/// paper's fixed point (27), `picard`, for comparison, within 64. All points in volume space, m.
/// closing: an offset added to u everywhere (a cycle's closing error, spread over its last step).
///
/// ok if the residual is below 1e-6 cells, det(I + g du/dx) > 0 at x, and no fold was met on the
/// straight way from `start` to x. (Checked at every 32nd of a cell, only in fields that have
/// folds; a way of more than 8 cells counts as folded.) A point behind a fold belongs to another
/// part of the material, even if its residual is small. Where it is not ok, x_m is the best point
/// found; the caller keeps its last point. Never NaN: with an argument that is not finite it is not
/// ok, x_m is the start (or the origin) and the residual infinite. Real-time safe.
BackTrack back_track(const MotionMap& map, double phase, glm::dvec3 target, glm::dvec3 start,
                     glm::dvec3 closing = glm::dvec3(0.0),
                     BackTracking method = BackTracking::kNewton) noexcept;

/// The same for one motion of a whole sequence: the place X in the reference frame of the material
/// that is at `target` at time t. Solves X + u(X, t) = target by Newton's method.
BackTrack back_track(SequenceSnapshot& motion, glm::dvec3 target, glm::dvec3 start) noexcept;

}  // namespace palpate
