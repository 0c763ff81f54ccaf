#pragma once

#include "compute/motion/quality.h"

namespace palpate::app {

/// The mask at the sample centres of another grid, nearest neighbour; outside of it nothing counts.
Mask mask_on(const Mask& mask, const Grid& onto);

/// Endpoint error with each component, along the index axes, in voxels of its own axis: what
/// "voxel" means for benchmarks on anisotropic data. Same samples as endpoint_error(). Errors: the
/// same.
Result<Spread> endpoint_error_own_voxels(const Field& u, const Field& truth, const Mask* mask);

}  // namespace palpate::app
