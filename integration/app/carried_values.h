#pragma once

#include <cstddef>

#include "compute/motion/sequence_motion.h"
#include "module/scene/moving_volume.h"

namespace palpate::app {

/// The sequence as the material of one frame that moves: every frame k holds the reference frame's
/// values where the motion takes them,
///   frame_k(y) = I_ref(phi_ref(phi_k^-1(y))),  phi_k(X) = X + u(X, t_k),
/// and the steps between frames are those of the same motion, phi_{k+1}(phi_k^-1(y)) - y. What is
/// felt is then the same wall in every frame; with each frame's own values a wall ends wherever the
/// scanner showed it weaker. I_ref is read by the cubic spline that the hand reads. `own`: the
/// frames as they are, on `grid`; its times stay. Needs memory for as many frames again, and a
/// second or so; uses all cores. Any thread but the servo's.
MovingVolume with_carried_values(const MovingVolume& own, const SequenceMotion& motion,
                                 const Grid& grid);

}  // namespace palpate::app
