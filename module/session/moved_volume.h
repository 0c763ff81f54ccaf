#pragma once

#include <cstddef>
#include <optional>
#include <stop_token>
#include <vector>

#include "compute/volume/volume.h"
#include "module/scene/moving_volume.h"

namespace palpate {

/// Reads a volume at one time as it is felt and shown: equations (24) to (26) of the paper. Places
/// in volume space, m. The volume must outlive it. One thread; no allocation after construction.
class MovedReader {
 public:
  /// time_s: of the sequence.
  MovedReader(const MovingVolume& volume, double time_s);

  /// Where the material that is at y now is in its frame; where no motion is known, y.
  glm::dvec3 material_at(glm::dvec3 y_m);
  /// The value of the material that is at x in its frame.
  double value(glm::dvec3 x_m) const;
  /// The signed distance to a segment's surface there, mm, above 0 inside; not a number where the
  /// segment is not known at this time.
  double distance_mm(const Segment& segment, glm::dvec3 x_m) const;

 private:
  const MovingVolume& volume_;
  FramePointer pointer_;
  size_t frame_, next_;
  const MotionMap* map_ = nullptr;
  std::optional<SequenceSnapshot> whole_;
};

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
