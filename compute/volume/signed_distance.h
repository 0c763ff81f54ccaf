#pragma once

#include "compute/volume/volume.h"

namespace palpate {

/// The volume after a Gaussian with this standard deviation, mm, >= 0; clamped to the edge. Uses
/// all cores.
Volume smoothed(const Volume& volume, double sigma_mm);

/// The exact Euclidean distance of each sample to the mask's border, mm, above 0 inside. The border
/// consists of the faces between voxels that count and voxels that do not, so the samples beside a
/// face are half a voxel away from it. Spacing may differ along the axes; beyond the grid nothing
/// counts. Separable lower envelopes, exact up to rounding; linear in the number of samples, on all
/// cores. Minus infinity everywhere if nothing counts.
Volume exact_signed_distance(const Mask& inside);

/// A smooth signed distance to the border of a mask, mm, above 0 inside: a wall to feel and show,
/// without the steps of the voxels. Thick slices are first interpolated by shape (from the
/// distances within the slices, Raya and Udupa 1990), so that the grid is nearly isotropic. Then
/// the exact distance is smoothed by a Gaussian, less where the mask is so thin that its sides
/// would merge. Parts of about a voxel's thickness or less become plates of one voxel
/// (with_sheets()). The result covers the voxels that count and a margin, with more slices if they
/// were thick, and with twice as many samples along each axis if it has such plates. At least one
/// voxel must count. Uses all cores.
Volume signed_distance(const Mask& inside);

}  // namespace palpate
