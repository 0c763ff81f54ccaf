#pragma once

#include "module/haptics/scene/scene_snapshot.h"

namespace palpate {

/// Predicts where moving volumes will be when they are displayed: extrapolates from the last two
/// snapshots that were given. Exact for constant velocity, angular velocity and growth. A value;
/// one thread.
class SnapshotAhead {
 public:
  /// `snapshot` with its transforms as they are expected at display_ns, at most 50 ms ahead, since
  /// a hand can not be predicted for longer. All else is copied. Snapshots are to be given in the
  /// order of their time.
  SceneSnapshot at(const SceneSnapshot& snapshot, int64_t display_ns);

 private:
  SceneSnapshot before_, newest_;  ///< before_ is at least 4 ms older
};

}  // namespace palpate
