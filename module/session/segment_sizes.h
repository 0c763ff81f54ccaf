#pragma once

#include <glm/glm.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "module/scene/moving_volume.h"

namespace palpate {

/// A number of a segment at the time of each of the volume's frames.
struct SizeCurve {
  std::string name;
  glm::vec3 colour{1.0F};      ///< red, green, blue, sRGB, 0 to 1
  std::vector<double> values;  ///< not a number where the segment is not known
};

/// How large the segments of a volume are over its frames.
struct SegmentSizes {
  /// ml, of each segment, without those that it encloses. They sum the share of each sample that is
  /// inside, (d + h/2) / h within [0, 1]: d the distance to the surface, h the edge of a sample.
  std::vector<SizeCurve> volumes_ml;
  /// The segment that is enclosed by another one, the wall; -1: none is.
  int cavity = -1;
  /// Thickness of the wall, mm: the mean over its outer surface of the way from there to the
  /// cavity, straight on along the gradient of the distance to the cavity. Counted is where this
  /// gradient is within 45 degrees of that of the distance to the outer surface, and the cavity is
  /// further away than a sample: not where a cut or a valve ends both. Empty without a cavity.
  SizeCurve wall_mm;
};

/// Measures the segments as they are felt and shown (MovedReader) at the times of the frames, on
/// 300,000 samples of a cubic lattice over the data. Where the work is stopped, what was measured
/// until then. Uses one core. Any thread but the servo thread.
SegmentSizes segment_sizes(const MovingVolume& volume, std::stop_token stop = {});

}  // namespace palpate
