#pragma once

#include <algorithm>
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
  /// times.steps() of them; null while not known: then the volume stands still
  std::vector<std::shared_ptr<const MotionMap>> steps;
};

/// A part of a volume that a person marked (a ventricle, a wall): its surface is closed and smooth
/// even where iso-surfaces of the values are not.
struct Segment {
  std::string name;
  glm::vec3 colour{1.0F};  ///< red, green, blue, 0 to 1
  /// Signed distance to its surface, mm, above 0 inside; smooth. One for each of the volume's
  /// frames, or one alone: that of the volume's segments_frame, which can be felt as soon as one
  /// motion carries it to the others.
  std::vector<std::shared_ptr<const FrameData>> distance_mm;
  bool shown = true;
};

/// How long hand and picture take from one motion of a volume to a better one.
constexpr double kMotionBlend_s = 0.5;

/// The share of the better one at a part of this time, 0 to 1: smooth at both ends.
inline double share_of_better(double part) noexcept {
  const double way = std::clamp(part, 0.0, 1.0);
  return way * way * (3.0 - 2.0 * way);
}

/// A volume that is felt and shown: frames, their times, and how they move. Immutable; handed
/// between threads by pointer. Another one that shares frames and fields is cheap to make: fields
/// that are found while the loop runs are handed over like this.
struct MovingVolume {
  std::string name;
  FrameTimes times;
  std::vector<std::shared_ptr<const FrameData>> frames;  ///< one per time; one alone with `whole`
  std::vector<Motion> motions;                           ///< empty: the data do not move
  /// One motion for all times. Then there is one frame, the motion's reference: its values are the
  /// material's, and what is at y at time t is the frame's value at X with X + u(X, t) = y. There
  /// are no other motions.
  std::shared_ptr<const SequenceMap> whole;
  /// What was felt in the place of `whole` up to now, described from the same frame; null: nothing.
  /// Hand and picture go from this to `whole` within kMotionBlend_s, so that no wall jumps.
  std::shared_ptr<const SequenceMap> whole_before;
  std::vector<Segment> segments;
  size_t segments_frame = 0;  ///< the frame of segments with one distance where there are many
  bool is_still() const { return frames.size() < 2 && !whole; }
};

/// Checks that frames, times and fields belong together: kBadInput with a sentence naming what does
/// not.
Status check(const MovingVolume& volume);

/// Whether the motion of `to` can take the place of that of `from` step by step (whole_before):
/// both carry the same frame, described from it, through the same times.
bool can_blend(const MovingVolume& from, const MovingVolume& to);

}  // namespace palpate
