#pragma once

#include <glm/glm.hpp>

#include "module/scene/motion_map.h"
#include "module/scene/scene_spec.h"
#include "module/scene/sequence_map.h"

namespace palpate {

/// What inverting x + g (u(x) + closing) = target gave.
struct BackTrack {
  glm::dvec3 x_m{0.0};      ///< in the data frame, volume space
  double residual_m = 0.0;  ///< |x + g (u(x) + closing) - target|
  int steps = 0;            ///< field reads spent, less the first
  bool ok = false;          ///< residual small enough and no fold at x; never true by guessing
  MotionSample at;          ///< the field at x_m
};

/// Equation (26): where in the data frame the material is that stands at `target` when the step to
/// the next frame is done by the share `phase`. Newton with the trilinear Jacobian, warm started
/// and safeguarded (a step that does not lower the residual is halved), within 16 steps; or the
/// paper's fixed point (27), `picard`, for comparison, within 64. All points in volume space, m.
/// closing: an offset added to u everywhere (a cycle's closing error, spread over its last step).
///
/// ok if the residual is below 1e-6 cells, det(I + g du/dx) > 0 at x, and no fold was met on the
/// straight way from `start` to x (looked for every 32nd of a cell, only in fields that have
/// folds; a way of more than 8 cells counts as folded): a point behind a fold belongs to another
/// part of the material, however well it fits. Where it is not ok, x_m is the best seen: the caller
/// holds. Never NaN: with an argument that is not finite it is not ok, x_m is the start (or the
/// origin) and the residual infinite. Real-time safe.
BackTrack back_track(const MotionMap& map, double phase, glm::dvec3 target, glm::dvec3 start,
                     glm::dvec3 closing = glm::dvec3(0.0),
                     BackTracking method = BackTracking::kNewton) noexcept;

/// The same for one motion of a whole sequence: where in the reference frame the material is that
/// stands at `target` at a time, X + u(X, t) = target, by Newton's method.
BackTrack back_track(SequenceMoment& motion, glm::dvec3 target, glm::dvec3 start) noexcept;

}  // namespace palpate
