#pragma once

#include <filesystem>
#include <vector>

#include "compute/motion/quality.h"

namespace palpate::app {

/// The mask at the sample centres of another grid, nearest neighbour; outside of it nothing counts.
Mask mask_on(const Mask& mask, const Grid& onto);

/// Endpoint error with each component, along the index axes, in voxels of its own axis: what
/// "voxel" means for benchmarks on anisotropic data. Same samples as endpoint_error(). Errors: the
/// same.
Result<Spread> endpoint_error_own_voxels(const Field& u, const Field& truth, const Mask* mask);

/// The points of one frame from a table with columns x0, y0, z0, x1, ... (LPS mm), one row per
/// material point. kBadInput if there is no such frame, or as read_landmarks().
Result<std::vector<glm::dvec3>> read_followed_points(const std::filesystem::path& file, int frame);

}  // namespace palpate::app
