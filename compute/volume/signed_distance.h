#pragma once

#include "compute/volume/volume.h"

namespace palpate {

/// The volume after a Gaussian with this standard deviation, mm, >= 0; border values clamped
/// outside. Uses all cores.
Volume smoothed(const Volume& volume, double sigma_mm);

/// The exact Euclidean distance of each sample to the mask's border, mm, above 0 inside: the border
/// is made of the faces between voxels that count and voxels that do not, so the samples beside a
/// face are half a voxel away from it. Spacing may differ along the axes; beyond the grid nothing
/// counts. Separable lower envelopes, exact but for rounding; linear in the number of samples, on
/// all cores. A mask in which nothing counts has minus infinity everywhere.
Volume exact_signed_distance(const Mask& inside);

/// A smooth signed distance to the border of a mask, mm, above 0 inside, as a wall to be felt and
/// seen: without the steps of the voxels. Thick slices are interpolated by their shape first (the
/// distances within the slices, Raya and Udupa 1990), so that the grid is nearly isotropic; then
/// the exact distance is smoothed by a Gaussian, the less where the mask is so thin that its sides
/// would melt together. The grid is the mask's own around what counts, extended beyond its ends,
/// with more slices where they were thick. What counts must not be empty. Uses all cores.
Volume signed_distance(const Mask& inside);

}  // namespace palpate
