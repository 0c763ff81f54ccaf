#include "module/view/stream_lines.h"

namespace palpate {

void StreamLines::add(Things& things, const MovingVolume& volume,
                      const Transform& world_from_volume, FramePointer pointer, double radius_m,
                      bool whole_frames) {
  if (frames_ != volume.frames) {
    frames_ = volume.frames;
    laid_.assign(frames_.size(), {});
  }
  const FrameData& frame = *frames_[size_t(pointer.frame)];
  Things& laid = laid_[size_t(pointer.frame)];
  if (laid.empty()) {
    TubeOptions options;
    options.seeds_per_axis = seeds_per_axis_;
    options.gradient = !frame.is_vector();
    add_stream_tubes(laid, Transform(), frame, options);
  }
  const MotionMap* motion = nullptr;
  if (!whole_frames && !volume.motions.empty() &&
      size_t(pointer.frame) < volume.motions[0].steps.size())
    motion = volume.motions[0].steps[size_t(pointer.frame)].get();
  const auto seen_at = [&](glm::dvec3 x) {
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
}

}  // namespace palpate
