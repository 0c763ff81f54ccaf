#pragma once

#include "compute/volume/volume.h"

namespace palpate {

/// The coefficients of the cubic B-spline that represents a sampled volume, from its samples: along
/// each axis
///   c_i = (-31 s_(i-2) + 84 s_(i-1) + 134 s_i + 84 s_(i+1) - 31 s_(i+2)) / 240.
/// Its second moment compensates the spline's own blur, so that the spline is exact for cubic
/// polynomials and a curved surface lies where it is. It lets 0.55 of what has 0.3 waves a sample
/// pass and next to nothing of what has 0.4: the grid hardly tells where these are between its
/// samples, and they tilt the normals of a surface. It lowers noise, too: the coefficients of white
/// noise have 0.45 of its deviation. Its price: beside a step from one sample to the next the
/// spline swings over by 6 %, and the value in a wall one voxel thick falls to 0.49, with the
/// samples as coefficients to 0.67.
///
/// Measured on a beating ball of R = 25 to 35 voxels with an edge of 1.5 voxels, stroked with up to
/// 7 N: the force is off by 0.0073 N RMS and 0.044 N at most. With the samples as coefficients
/// 0.0125 and 0.094 (0.0078 of it along the radius, as the blur puts the surface further in). With
/// a filter whose zero is at 0.5 waves a sample, (-5, 12, 34, 12, -5) / 48, 0.0082 and 0.059. With
/// (-1, 8, -1) / 6, which only takes back the blur, more than with none (0.016 and 0.086 against
/// 0.012 and 0.056 on some of the strokes). The two samples beside each end of an axis, and samples
/// whose neighbours are not finite, stay as they are, as does all along an axis of fewer than five.
/// Works in place, on all cores: not for the servo thread.
Volume spline_coefficients(Volume samples);

}  // namespace palpate
