#pragma once

#include <cstdint>

#include "tests/lab/stability/motion_pair.h"

namespace palpate::stability {

inline constexpr int kHeartFrames = 12;
inline constexpr double kRange = 600.0;  ///< of a body's intensities

/// The pairs of the maps, one by one. Lengths in voxels of the finest axis (1 mm); `size` voxels
/// each way.

/// Structures of one size, shifted as a whole.
MotionPair shifted_pair(int size, double displacement, double structure, uint32_t seed);
/// A swirl of 3 voxels in a body with structures of 6 and 13; moving has more gain, and a bias
/// that goes across it by a share of its range.
MotionPair lit_pair(int size, double more_gain, double bias, uint32_t seed);
/// The swirl of so many voxels; both frames have noise, as a share of the body's deviation.
MotionPair noisy_pair(int size, double noise, double displacement, uint32_t seed);
/// A bump of so many voxels in the middle, 12 voxels wide or as wide as a ball there in which there
/// is nothing to see; scored in the ball, or 4 voxels about its middle.
MotionPair flat_pair(int size, double radius, double displacement, uint32_t seed);
/// Material that runs to and fro along x, u = g / k sin(k x): its gradient is g at most, and from 1
/// on it folds.
MotionPair folding_pair(int size, double gradient, double wavelength, uint32_t seed);
/// Two halves that slide past each other along the face between them.
MotionPair sliding_pair(int size, double shift, uint32_t seed);
/// The same, scored so many voxels from the face, half a voxel to each side.
MotionPair scored_at(MotionPair sliding, double distance);
/// The beating heart in 12 frames: a frame and the one after so many left out; -1: the same
/// frame once more, with other noise. Scored in the wall.
MotionPair heart_pair(int size, int left_out, int frame, uint32_t seed);
/// The swirl in a body of one size of structure, slices so many times as thick as the voxels are
/// wide.
MotionPair thick_pair(int size, double ratio, double structure, uint32_t seed);

}  // namespace palpate::stability
