#pragma once

#include <optional>
#include <vector>

#include "compute/volume/volume.h"

namespace palpate {

/// SD of the white noise in a volume, in the volume's own unit. Every sample is filtered by the
/// product of second differences (1, -2, 1) along each axis that has three samples or more, which
/// removes all structure that is smooth along any one axis; the noise SD is 1.4826 median
/// |filtered| / sqrt(6)^axes. Places where all neighbours are equal (padding outside a scanner's
/// circle) do not count. Noise that a scanner has blurred gives a smaller value; structure that is
/// rough along all axes adds to it (heart phantom of 64^3 with an SD of 18: 18.3). 0 for a constant
/// volume. Reads at most a few 100,000 samples. Any thread.
double noise_sd(const Volume& volume);

/// What remains in one cell of two locally normalised frames after motion correction.
struct CellLeft {
  /// q, mean of the squared frames, 0 to 1; 0 where normalisation took everything for noise
  float structure;
  float difference;  ///< r^2, mean of the squared difference
};

/// W of the noise model r^2 = W (1 - q). It is fitted together with a term for motion that was not
/// found, which grows with structure,
///   r^2 = W (1 - q) + 2 R q,  W, R >= 0,
/// to the lower quartiles of eight groups of cells of rising structure (so W is about half of the
/// mean). Noise is told from motion by where it is, so noise of any spatial correlation is covered.
/// Empty if there are fewer than 64 cells. Any thread.
std::optional<double> noise_left(std::vector<CellLeft> cells);

/// What one cell's equations say of its noise (shaders/motion/shared_noise.comp).
struct CellNoise {
  float structure;   ///< q, as in CellLeft
  float correlated;  ///< k, how many of its voxels share their noise; 0.7 in the median if none do
  float different;   ///< u, the part of the frames' variance that is a difference between them
};

/// Whether noise is correlated over so many voxels that neighbouring cells share it: then cells
/// predict each other's noise, as they do a motion. Told by the quarter of the cells with the least
/// structure: their median k is above 3 and their median u above 0.18. (Motion that was not found
/// raises k, too, but there the frames share most of what they show.) True if there are fewer than
/// 64 cells. Any thread.
bool cells_share_noise(std::vector<CellNoise> cells);

}  // namespace palpate
