#pragma once

#include <memory>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "module/scene/frame_data.h"
#include "module/scene/motion_map.h"
#include "module/scene/playback.h"

namespace palpate {

/// One motion of a volume's data: a field per step from a frame to the next. Different properties
/// of one data set may move differently (a vortex, a pressure front): then it has several, by name.
struct Motion {
  std::string name;
  std::vector<std::shared_ptr<const MotionMap>>
      steps;  ///< times.steps() of them; null where not known (yet): still
};

/// A volume as hand and eye take it: frames, when they are, and how they move. Immutable once made;
/// handed between threads by pointer. Making another that shares frames and fields is cheap: that
/// is how fields arrive while the loop runs.
struct MovingVolume {
  std::string name;
  FrameTimes times;
  std::vector<std::shared_ptr<const FrameData>> frames;  ///< one per time
  std::vector<Motion> motions;                           ///< empty: the data do not move
  bool is_still() const { return frames.size() < 2; }
};

/// Checks that frames, times and fields belong together: kBadInput with a sentence naming what does
/// not.
Status check(const MovingVolume& volume);

}  // namespace palpate
