#pragma once

#include <memory>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "module/scene/frame_data.h"
#include "module/scene/motion_map.h"
#include "module/scene/playback.h"
#include "module/scene/sequence_map.h"

namespace palpate {

/// One motion of a volume's data: a field per step from a frame to the next. Different properties
/// of one data set may move differently (a vortex, a pressure front): then it has several, by name.
struct Motion {
  std::string name;
  std::vector<std::shared_ptr<const MotionMap>>
      steps;  ///< times.steps() of them; null where not known (yet): still
};

/// A part of a volume that somebody marked out (a ventricle, a wall), with a surface that is closed
/// and smooth where the values' own is not.
struct Segment {
  std::string name;
  glm::vec3 colour{1.0F};  ///< red, green, blue, 0 to 1
  /// Signed distance to its surface, mm, above 0 inside; smooth. One for each of the volume's
  /// frames, or one alone: that of the volume's segments_frame, which can be felt as soon as one
  /// motion carries it to the others.
  std::vector<std::shared_ptr<const FrameData>> distance_mm;
  bool shown = true;
};

/// A volume as hand and eye take it: frames, when they are, and how they move. Immutable once made;
/// handed between threads by pointer. Making another that shares frames and fields is cheap: that
/// is how fields arrive while the loop runs.
struct MovingVolume {
  std::string name;
  FrameTimes times;
  std::vector<std::shared_ptr<const FrameData>> frames;  ///< one per time; one alone with `whole`
  std::vector<Motion> motions;                           ///< empty: the data do not move
  /// One motion for all times. Then there is one frame, the motion's reference: its values are the
  /// material's, and what is at y at time t is the frame's value at X with X + u(X, t) = y. There
  /// are no other motions.
  std::shared_ptr<const SequenceMap> whole;
  std::vector<Segment> segments;
  size_t segments_frame = 0;  ///< the frame of segments with one distance where there are many
  bool is_still() const { return frames.size() < 2 && !whole; }
};

/// Checks that frames, times and fields belong together: kBadInput with a sentence naming what does
/// not.
Status check(const MovingVolume& volume);

}  // namespace palpate
