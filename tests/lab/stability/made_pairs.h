#pragma once

#include <cstdint>

#include "tests/lab/stability/motion_pair.h"

namespace palpate::stability {

inline constexpr int kHeartFrames = 12;
inline constexpr double kRange = 600.0;  ///< of a body's intensities

/// The pairs of the maps, one by one. Lengths in voxels of the finest axis (1 mm); `size` voxels
/// along each axis.

/// Structures of one size, shifted as a whole.
MotionPair shifted_pair(int size, double displacement, double structure, uint32_t seed);
/// A swirl of 3 voxels in a body with structures of 6 and 13 voxels; moving has a larger gain, and
/// a bias along one axis, as a fraction of the range.
MotionPair lit_pair(int size, double more_gain, double bias, uint32_t seed);
/// The swirl of `displacement` voxels; both frames have noise, as a fraction of the body's
/// deviation.
MotionPair noisy_pair(int size, double noise, double displacement, uint32_t seed);
/// A bump of `displacement` voxels in the middle, 12 voxels wide or as wide as a ball there without
/// any structure; scored in the ball, or within 4 voxels of its middle.
MotionPair flat_pair(int size, double radius, double displacement, uint32_t seed);
/// Material that moves back and forth along x, u = g / k sin(k x): its gradient is at most g, and
/// from 1 on it folds.
MotionPair folding_pair(int size, double gradient, double wavelength, uint32_t seed);
/// Two halves that slide past each other along the face between them.
MotionPair sliding_pair(int size, double shift, uint32_t seed);
/// The same, scored at this distance from the face in voxels, half a voxel to each side.
MotionPair scored_at(MotionPair sliding, double distance);
/// The beating heart in 12 frames: a frame and the one after `left_out` frames; -1: the same frame
/// again, with other noise. Scored in the wall.
MotionPair heart_pair(int size, int left_out, int frame, uint32_t seed);
/// The swirl in a body of one size of structure, with slices `ratio` times as thick as the voxels
/// are wide.
MotionPair thick_pair(int size, double ratio, double structure, uint32_t seed);

}  // namespace palpate::stability
