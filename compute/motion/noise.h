#pragma once

#include <optional>
#include <vector>

#include "compute/volume/volume.h"

namespace palpate {

/// SD of the white noise in a volume, in the volume's own unit. Every sample is filtered by the
/// product of second differences (1, -2, 1) along each axis that has three samples or more, which
/// removes all structure that is smooth along any one axis; the noise SD is 1.4826 median
/// |filtered| / sqrt(6)^axes. Places where all neighbours are equal (padding outside a scanner's
/// circle) do not count. Noise that a scanner has blurred comes out smaller than it is; structure
/// that is rough along all axes adds to it (heart phantom of 64^3 with an SD of 18: 18.3). 0 for a
/// constant volume. Looks at no more than a few 100,000 samples. Any thread.
double noise_sd(const Volume& volume);

/// What two locally normalised frames still differ by in a cell of the field that brings them
/// together: the mean of their squares and of their squared difference.
struct CellLeft {
  float structure;   ///< q, 0 to 1: 0 where there is nothing but what normalisation holds for noise
  float difference;  ///< r^2
};

/// W, so that noise alone leaves r^2 = W (1 - q): fitted together with what motion leaves that was
/// not found, which grows with the structure,
///   r^2 = W (1 - q) + 2 R q,  W, R >= 0,
/// to the lower quartiles of eight groups of cells of rising structure (so W is about half of the
/// mean). Noise of any correlation is told from motion by where it is, not by what it looks like.
/// Nothing if there are fewer than 64 cells: too few to say. Any thread.
std::optional<double> noise_left(std::vector<CellLeft> cells);

}  // namespace palpate
