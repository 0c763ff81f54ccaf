#pragma once

#include "compute/volume/volume.h"

namespace palpate {

/// The signed distance of a mask with its sheets: parts that are about one voxel thick or thinner,
/// such as the leaflets of a valve. The voxels of an oblique sheet touch at edges only or leave
/// holes, so their distance hardly rises above 0 there. Where a plane fits the voxels, the distance
/// is instead that of a plate of one voxel's thickness around this plane (moving least squares,
/// Gaussian weights); holes of up to three voxels are closed. `distance` is on the mask's grid, mm,
/// above 0 inside. The result has twice as many samples along each axis, which the ridge of a plate
/// needs. Without sheets (fewer than a tenth of the voxels that count), or where the result would
/// be larger than kMostSheetSamples, it is `distance`. Uses all cores.
Volume with_sheets(const Mask& mask, Volume distance);

inline constexpr size_t kMostSheetSamples = size_t(1) << 26;

}  // namespace palpate
