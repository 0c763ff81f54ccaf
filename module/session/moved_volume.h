#pragma once

#include <cstddef>
#include <stop_token>
#include <vector>

#include "compute/volume/volume.h"
#include "module/scene/moving_volume.h"

namespace palpate {

/// A volume at one time, as hand and eye have it.
struct MovedVolume {
  Volume values;  ///< empty: its data are formulas without samples, or it was stopped
  /// Per sample of it: from where the material was in its frame to where it is, mm, LPS.
  std::vector<glm::vec3> moved_mm;
};

/// Equations (24) to (26) at the samples of the volume's own grid, or of one that is coarser by a
/// whole number so that it has at most `most_samples`. time_s: of the sequence. One core; any
/// thread but the servo's.
MovedVolume moved_volume(const MovingVolume& volume, double time_s, size_t most_samples,
                         std::stop_token stop = {});

}  // namespace palpate
