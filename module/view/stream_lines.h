#pragma once

#include <memory>
#include <vector>

#include "module/scene/moving_volume.h"
#include "module/scene/scene_spec.h"
#include "module/scene/transform.h"
#include "module/view/things.h"

namespace palpate {

/// The stream tubes of a volume, frame by frame: laid when a frame is first seen (some tens of
/// milliseconds), then only moved. One thread.
class StreamLines {
 public:
  explicit StreamLines(int seeds_per_axis) : seeds_per_axis_(seeds_per_axis) {}

  /// Appends the tubes of the frame that the pointer is in, each point carried along by the
  /// volume's first motion as the material is (x + g u(x)), unless they are to stay
  /// (`whole_frames`). radius_m: world. Returns the least and greatest length of the vectors that
  /// their colours cover; the greatest is 0 where there are no tubes.
  glm::dvec2 add(Things& things, const MovingVolume& volume, const Transform& world_from_volume,
                 FramePointer pointer, double radius_m, bool whole_frames);

 private:
  int seeds_per_axis_;
  std::vector<std::shared_ptr<const FrameData>> frames_;  ///< of which laid_ are
  std::vector<Things> laid_;                              ///< volume space; empty: not yet laid
  std::vector<glm::dvec2> lengths_;                       ///< that their colours cover
};

}  // namespace palpate
