#pragma once

#include <memory>

#include "tests/lab/stability/made_pairs.h"
#include "tests/lab/stability/map.h"

/// Where the estimation of motion fails: the paper's Demons ("classic") compared with palpate's
/// method.
namespace palpate::stability {

/// The quantity of a cell's colour: the mean error in voxels, or the folded share (%) of all
/// voxels.
enum class Colour { kError, kFolds };

/// The outcome for a pair. A failure: more than 5 % of the scored voxels have an error of more than
/// a voxel, or there is a fold. palpate flags it if its verdict is not ok, or if its confidence is
/// low (below kLowConfidence) at nine tenths of the wrong voxels; "classic" can flag neither.
Cell motion_cell(const std::shared_ptr<vulkan::Context>& context, const MotionPair& pair,
                 bool palpate, Colour colour = Colour::kError);
Cell motion_cell(const Found& found, const MotionPair& pair, bool palpate, Colour colour);
/// The result of either method for a pair.
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
