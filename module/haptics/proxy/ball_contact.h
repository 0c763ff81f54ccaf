#pragma once

#include "module/haptics/mode.h"
#include "module/scene/frame_data.h"

namespace palpate {

/// The ball at the tool's tip in a data frame. derivative: of the map from the data frame to the
/// world. Real-time safe.
inline ToolBall ball_in_data(double radius_m, const glm::dmat3& derivative) noexcept {
  return {radius_m * glm::inverse(derivative)};
}

/// The point of the ball's surface at which the values of a frame are greatest: where a surface
/// that keeps the ball out of higher values touches it. Gradient ascent on the ball from the
/// greatest of 16 places: along the centre's gradient, where it touched last, along the axes and
/// the diagonals. Exact for planes and spheres. Where values are the same all around, and where
/// none is finite: the centre. `last` is read and renewed: the place on the ball of radius 1, or
/// zero. A contact that no place and no gradient shows (smaller than a cone of 35 degrees, in data
/// without any slope beside it) is missed. At most 16 + 8 samples. Space: the volume's, m.
/// Real-time safe.
glm::dvec3 ball_contact(const FrameData& frame, glm::dvec3 centre, const ToolBall& ball,
                        glm::dvec3& last) noexcept;

}  // namespace palpate
