#pragma once

#include "module/haptics/scene_moment.h"

namespace palpate {

/// Where volumes that move will be when they are seen: each goes on as between the last two ticks
/// that were asked about. A constant speed, a constant turn and a constant growth are met exactly.
/// A value; one thread.
class MomentAhead {
 public:
  /// `moment` with its transforms as they are expected at display_ns, at most 50 ms ahead: further
  /// on a hand does what it likes. All else is as it was. Moments are to be given in rising order.
  SceneMoment at(const SceneMoment& moment, int64_t display_ns);

 private:
  SceneMoment before_, newest_;  ///< before_ is at least 4 ms older
};

}  // namespace palpate
