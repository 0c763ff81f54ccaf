#pragma once

#include "compute/volume/volume.h"

namespace palpate {

/// The coefficients of the cubic B-spline that stands for a sampled volume, from its samples: along
/// each axis
///   c_i = (-5 s_(i-2) + 12 s_(i-1) + 34 s_i + 12 s_(i+1) - 5 s_(i+2)) / 48,
/// the only symmetric filter of five that makes the spline exact for cubic polynomials (its second
/// moment takes back the spline's own blur, so that a curved surface lies where it is) and that
/// takes out what alternates from sample to sample (which the grid can not place, and which tilts
/// the normals of a surface between samples). It lowers noise, too: the coefficients of white noise
/// have 0.52 of its deviation. Its price: beside a step from one sample to the next the spline
/// swings over by 5 %, and the value in a wall one voxel thick falls to 0.56 instead of 0.67.
///
/// Measured on a ball of R = 25 to 35 voxels with an edge of 1.5 voxels, pressed with up to 7 N:
/// the force is off by 0.0080 N RMS and 0.041 N at most; with the samples as coefficients 0.0118
/// and 0.056 (0.0079 of it along the radius, as the blur puts the surface further in), with the
/// filter
/// (-1, 8, -1) / 6, which only takes back the blur, 0.0162 and 0.086.
/// The two samples beside each end of an axis, and samples whose neighbours are not finite, stay as
/// they are, as does all along an axis of fewer than five. Works in place, on all cores: not for
/// the servo thread.
Volume spline_coefficients(Volume samples);

}  // namespace palpate
