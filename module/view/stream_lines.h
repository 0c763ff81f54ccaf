#pragma once

#include <memory>
#include <vector>

#include "module/scene/moving_volume.h"
#include "module/scene/scene_spec.h"
#include "module/scene/transform.h"
#include "module/view/things.h"

namespace palpate {

/// Tubes along the field lines of a volume's vectors, or of the gradient of its scalars, through a
/// lattice of seeds: the classic Runge-Kutta method with steps of one detail_m. Laid when a frame
/// is first known (some tens of milliseconds each), then only moved. One thread.
class StreamLines {
 public:
  /// seeds_per_axis: of the lattice over the data's box.
  explicit StreamLines(int seeds_per_axis) : seeds_per_axis_(seeds_per_axis) {}

  /// Appends the tubes of the frame that the pointer is in, each point carried along by the
  /// volume's first motion as the material is (x + g u(x)), unless they are to stay
  /// (`whole_frames`). radius_m: world. Returns the least and greatest length of the vectors that
  /// their colours (tube_colour) cover: of all frames, so that a colour means the same in each; the
  /// greatest is 0 where there are no tubes.
  glm::dvec2 add(Things& things, const MovingVolume& volume, const Transform& world_from_volume,
                 FramePointer pointer, double radius_m, bool whole_frames);

 private:
  struct LineSegment {
    glm::dvec3 from, to;  ///< volume space
    double length;        ///< of the vector in its middle
  };
  using Lines = std::vector<LineSegment>;
  Lines lines_of(const FrameData& frame) const;
  void lay(const MovingVolume& volume);

  int seeds_per_axis_;
  std::vector<std::shared_ptr<const FrameData>> frames_;  ///< of which laid_ are
  std::vector<std::shared_ptr<const Lines>> laid_;
  glm::dvec2 lengths_{0.0};  ///< least and greatest of all
};

}  // namespace palpate
