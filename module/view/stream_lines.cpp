#include "module/view/stream_lines.h"

namespace palpate {

glm::dvec2 StreamLines::add(Things& things, const MovingVolume& volume,
                            const Transform& world_from_volume, FramePointer pointer,
                            double radius_m, bool whole_frames) {
  if (frames_ != volume.frames) {
    frames_ = volume.frames;
    laid_.assign(frames_.size(), {});
    lengths_.assign(frames_.size(), glm::dvec2(0.0));
  }
  // A volume with one motion for all times has one frame, which the motion carries.
  const size_t of = volume.whole ? 0 : size_t(pointer.frame);
  const FrameData& frame = *frames_[of];
  Things& laid = laid_[of];
  if (laid.empty()) {
    TubeOptions options;
    options.seeds_per_axis = seeds_per_axis_;
    options.gradient = !frame.is_vector();
    lengths_[of] = add_stream_tubes(laid, Transform(), frame, options);
  }
  const MotionMap* motion = nullptr;
  if (!whole_frames && !volume.motions.empty() &&
      size_t(pointer.frame) < volume.motions[0].steps.size())
    motion = volume.motions[0].steps[size_t(pointer.frame)].get();
  const bool carried = volume.whole && !whole_frames;
  const TimeWeights time =
      carried ? volume.whole->basis().at(pointer.frame, pointer.phase) : TimeWeights{};
  const auto seen_at = [&](glm::dvec3 x) {
    if (carried) x += volume.whole->displacement(x, time);
    if (motion) x += pointer.phase * motion->displacement(x);
    return world_from_volume.world_from_volume(x);
  };
  things.reserve(things.size() + laid.size());
  glm::dvec3 last(1e300), last_seen(0.0);  // segments follow each other: every place once
  for (const RoundCone& rod : laid) {
    const glm::dvec3 from = rod.from == last ? last_seen : seen_at(rod.from);
    last = rod.to;
    last_seen = seen_at(rod.to);
    things.push_back({from, last_seen, radius_m, radius_m, rod.colour});
  }
  return lengths_[of];
}

}  // namespace palpate
