#pragma once

#include <memory>

#include "integration/stability/map.h"
#include "integration/stability/motion_pair.h"

/// Where the estimation of motion fails: the paper's Demons ("classic") beside palpate's own.
namespace palpate::stability {

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

/// What a cell's colour shows: the mean error in voxels, or the folded share (%) of all voxels.
enum class Colour { kError, kFolds };

/// What becomes of a pair. A failure: more than 5 % of the scored voxels are wrong by more than a
/// voxel, or a fold. palpate flags it if its verdict is not ok, or if its confidence is below 0.3
/// at nine tenths of what is wrong; "classic" has no word for either.
Cell motion_cell(const std::shared_ptr<vulkan::Context>& context, const MotionPair& pair,
                 bool palpate, Colour colour = Colour::kError);
Cell motion_cell(const Found& found, const MotionPair& pair, bool palpate, Colour colour);
/// What either method finds for a pair.
Found found_by(const std::shared_ptr<vulkan::Context>& context, const MotionPair& pair,
               bool palpate);

using MotionMapMaker = StabilityMap (*)(const std::shared_ptr<vulkan::Context>&, const Making&);
StabilityMap displacement_map(const std::shared_ptr<vulkan::Context>&, const Making&);
StabilityMap contrast_map(const std::shared_ptr<vulkan::Context>&, const Making&);
StabilityMap noise_map(const std::shared_ptr<vulkan::Context>&, const Making&);
StabilityMap aperture_map(const std::shared_ptr<vulkan::Context>&, const Making&);
StabilityMap folding_map(const std::shared_ptr<vulkan::Context>&, const Making&);
StabilityMap sliding_map(const std::shared_ptr<vulkan::Context>&, const Making&);
StabilityMap frames_map(const std::shared_ptr<vulkan::Context>&, const Making&);
StabilityMap anisotropy_map(const std::shared_ptr<vulkan::Context>&, const Making&);

}  // namespace palpate::stability
