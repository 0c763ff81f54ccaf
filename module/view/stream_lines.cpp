#include "module/view/stream_lines.h"

#include <algorithm>

#include "compute/volume/parallel.h"
#include "module/scene/field_line.h"

namespace palpate {
namespace {

constexpr int kMostSegments = 80;  // of one tube, to either side of its seed

}  // namespace

StreamLines::Lines StreamLines::lines_of(const FrameData& frame) const {
  const auto vector = [&](glm::dvec3 x) {
    return frame.is_vector() ? frame.vector(x) : frame.scalar_gradient(x);
  };
  LineOptions line;
  line.low_m = frame.low_m();
  line.high_m = frame.high_m();
  line.step_m = frame.detail_m();
  line.most_steps = kMostSegments;
  line.least_length = 0.0;
  const glm::dvec3 extent = line.high_m - line.low_m;
  Lines lines;
  const int n = seeds_per_axis_;
  for (int seed = 0; seed < n * n * n; ++seed) {
    const glm::dvec3 cell(seed % n, seed / n % n, seed / n / n);
    const glm::dvec3 start = line.low_m + extent * (cell + 0.5) / double(n);
    for (const double direction : {1.0, -1.0}) {
      const std::vector<glm::dvec3> places = field_line(vector, start, direction, line).places_m;
      for (size_t k = 1; k < places.size(); ++k)
        lines.push_back(
            {places[k - 1], places[k], glm::length(vector(0.5 * (places[k - 1] + places[k])))});
    }
  }
  return lines;
}

/// Lays the lines of frames that are new; of a live volume most are not.
void StreamLines::lay(const MovingVolume& volume) {
  std::vector<std::shared_ptr<const Lines>> laid(volume.frames.size());
  std::vector<int> fresh;
  for (size_t k = 0; k < laid.size(); ++k) {
    const auto known = std::find(frames_.begin(), frames_.end(), volume.frames[k]);
    if (known != frames_.end())
      laid[k] = laid_[size_t(known - frames_.begin())];
    else
      fresh.push_back(int(k));
  }
  const double cost = 1e3 * seeds_per_axis_ * seeds_per_axis_ * seeds_per_axis_ * kMostSegments;
  parallel_ranges(int(fresh.size()), cost, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const auto frame = size_t(fresh[size_t(k)]);
      laid[frame] = std::make_shared<const Lines>(lines_of(*volume.frames[frame]));
    }
  });
  frames_ = volume.frames;
  laid_ = std::move(laid);
  lengths_ = {1e300, 0.0};
  for (const auto& lines : laid_)
    for (const LineSegment& segment : *lines)
      if (segment.length > 0.0)
        lengths_ = {std::min(lengths_.x, segment.length), std::max(lengths_.y, segment.length)};
}

glm::dvec2 StreamLines::add(Things& things, const MovingVolume& volume,
                            const Transform& world_from_volume, FramePointer pointer,
                            double radius_m, bool whole_frames) {
  if (frames_ != volume.frames) lay(volume);
  // A volume with one motion for all times has one frame, which the motion carries.
  const Lines& laid = *laid_[volume.whole ? 0 : size_t(pointer.frame)];
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
  for (const LineSegment& segment : laid) {
    const glm::dvec3 from = segment.from == last ? last_seen : seen_at(segment.from);
    last = segment.to;
    last_seen = seen_at(segment.to);
    things.push_back(
        {from, last_seen, radius_m, radius_m, tube_colour(segment.length, lengths_.x, lengths_.y)});
  }
  return lengths_;
}

}  // namespace palpate
