#pragma once

#include <array>
#include <cstdint>

#include "module/scene/scene.h"
#include "module/scene/transform.h"

namespace palpate {

/// The pose of a volume at every haptic frame, from poses that come now and then: section 5 of the
/// method. A value: no clock, no allocation. `add` what arrives (also several at once, also late or
/// twice), then `at` the haptic frame's time, rising.
class MovingPose {
 public:
  explicit MovingPose(PosePath path, const Transform& start);

  /// A pose that holds at time_ns (monotonic). Times that do not rise are ignored. Turns the
  /// quaternion to the nearer hemisphere.
  void add(const Transform& pose, int64_t time_ns) noexcept;
  /// The pose for this haptic frame.
  Transform at(int64_t now_ns) noexcept;
  /// True once nothing has moved for so long that it stands still: the volume may take the still
  /// path.
  bool at_rest() const noexcept;

 private:
  // To be filled in by the implementation; a plain copyable value.
};

}  // namespace palpate
