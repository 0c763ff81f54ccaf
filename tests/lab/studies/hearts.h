#pragma once

#include <memory>

#include "module/haptics/proxy/haptics.h"

namespace palpate::studies {

/// What moves in a scene of hearts.
enum class Moves { kNothing, kTransform, kBoth };

/// Hearts as in `palpate feel heart`, 8 mm apart if there are several; moving transforms come from
/// a second hand. Every second mode of a heart guides along the gradient, the others are its wall.
SceneSpec hearts_spec(int volumes, int modes_of_each, Moves moves,
                      PosePath path = PosePath::kSmooth,
                      BackTracking method = BackTracking::kNewton);

/// The heart phantom of 128^3 at 1 mm. Made once and kept; still: its first frame alone.
std::shared_ptr<const MovingVolume> heart_volume(bool still);

/// A hand on hearts: up to 3 mm inside of the outer wall for most of the time, 1 mm outside for the
/// rest, stroking at 50 mm/s. Poses come from graphics frames of alternately 11 and 22 ms.
class HeartHand {
 public:
  HeartHand(int volumes, Moves moves) : volumes_(volumes), moves_(moves) {}
  /// The next millisecond. first: the first volume's frame pointer in the last one.
  void next(TickInput& input, FramePointer first) noexcept;
  int64_t ticks() const { return tick_; }

 private:
  int volumes_;
  Moves moves_;
  int64_t tick_ = 0, next_pose_ns_ = 0;
  bool long_frame_ = false;
};

}  // namespace palpate::studies
