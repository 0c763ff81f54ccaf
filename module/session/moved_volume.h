#pragma once

#include <cstddef>
#include <stop_token>
#include <vector>

#include "compute/volume/volume.h"
#include "module/scene/moving_volume.h"

namespace palpate {

/// A volume at one time, as it is felt and shown.
struct MovedVolume {
  Volume values;  ///< empty: its data are formulas without samples, or the work was stopped
  /// Per sample of `values`: from where its material is in its frame to where it is now, mm, LPS.
  std::vector<glm::vec3> moved_mm;
};

/// Evaluates equations (24) to (26) at the samples of the volume's own grid, or of one that is
/// coarser by an integer factor so that it has at most `most_samples`. time_s: of the sequence.
/// Uses one core. Any thread but the servo thread.
MovedVolume moved_volume(const MovingVolume& volume, double time_s, size_t most_samples,
                         std::stop_token stop = {});

}  // namespace palpate
