#pragma once

#include <memory>

#include "module/haptics/haptics.h"

namespace palpate::studies {

/// What moves in a scene of hearts.
enum class Moves { kNothing, kTransform, kBoth };

/// Hearts as `palpate feel heart` has them, 8 mm apart where there are several; where transforms
/// move, they come from a second hand. Every second mode of a heart is one that guides along the
/// gradient, all others are its wall.
SceneSpec hearts_spec(int volumes, int modes_of_each, Moves moves,
                      PosePath path = PosePath::kSmooth,
                      BackTracking method = BackTracking::kNewton);

/// The heart phantom of 128^3 at 1 mm. Made once and kept: still is its first frame alone.
std::shared_ptr<const MovingVolume> heart_volume(bool still);

/// A hand on hearts: 3 mm and less inside of the outer wall for most of the time, 1 mm outside for
/// the rest, stroking at 50 mm/s. Poses come from graphics frames of 11 and 22 ms in turn.
class HeartHand {
 public:
  HeartHand(int volumes, Moves moves) : volumes_(volumes), moves_(moves) {}
  /// The next millisecond. first: where the first volume's sequence stood in the last one.
  void next(TickInput& input, FramePointer first) noexcept;
  int64_t ticks() const { return tick_; }

 private:
  int volumes_;
  Moves moves_;
  int64_t tick_ = 0, next_pose_ns_ = 0;
  bool long_frame_ = false;
};

}  // namespace palpate::studies
