#include "module/scene/moving_volume.h"

#include <cmath>

namespace palpate {
namespace {

Error refused(const MovingVolume& volume, const std::string& what) {
  return {ErrorKind::kBadInput, "The volume \"" + volume.name + "\" can not be used: " + what};
}

/// What is wrong with the times, or nothing.
std::string wrong_times(const FrameTimes& times) {
  const std::vector<double>& t = times.times_s;
  if (t.front() != 0.0) return "its first frame must be at 0 s.";
  for (size_t k = 1; k < t.size(); ++k)
    if (!(std::isfinite(t[k]) && t[k] > t[k - 1]))
      return "frame " + std::to_string(k) + " is not later than the frame before it.";
  if (!std::isfinite(times.cycle_s) || times.cycle_s < 0.0)
    return "the length of its cycle must be a time, or 0 if it does not repeat.";
  if (times.cyclic() && t.size() < 2) return "one frame can not repeat; give two or more.";
  if (times.cyclic() && times.cycle_s <= t.back())
    return "its cycle ends before its last frame; give a longer cycle.";
  return {};
}

}  // namespace

Status check(const MovingVolume& volume) {
  const size_t frames = volume.frames.size();
  if (frames == 0) return refused(volume, "it has no frames.");
  if (volume.whole) {
    const TimeBasis& basis = volume.whole->basis();
    if (frames != 1 || !volume.motions.empty())
      return refused(volume,
                     "one motion tells all its times, so it has one frame and no other motion.");
    if (basis.times_s.size() != volume.times.times_s.size() ||
        (basis.cycle_s > 0.0) != volume.times.cyclic())
      return refused(volume, "its motion is that of " + std::to_string(basis.times_s.size()) +
                                 " frames" + (basis.cycle_s > 0.0 ? " in a cycle" : "") +
                                 ", but it has " + std::to_string(volume.times.times_s.size()) +
                                 (volume.times.cyclic() ? " in a cycle." : "."));
  } else if (volume.times.times_s.size() != frames)
    return refused(volume, "it has " + std::to_string(frames) + " frames but " +
                               std::to_string(volume.times.times_s.size()) + " times.");
  if (const std::string wrong = wrong_times(volume.times); !wrong.empty())
    return refused(volume, wrong);
  for (size_t k = 0; k < frames; ++k) {
    if (!volume.frames[k]) return refused(volume, "frame " + std::to_string(k) + " has no data.");
    if (volume.frames[k]->is_vector() != volume.frames[0]->is_vector())
      return refused(volume, "frame " + std::to_string(k) +
                                 " differs from the first one in holding vectors or scalars.");
  }
  if (!volume.segments.empty() && volume.segments_frame >= frames)
    return refused(volume, "its segments are those of frame " +
                               std::to_string(volume.segments_frame) + ", which it does not have.");
  for (const Segment& segment : volume.segments)
    if (segment.distance_mm.size() != frames && segment.distance_mm.size() != 1)
      return refused(volume, "its segment \"" + segment.name + "\" has " +
                                 std::to_string(segment.distance_mm.size()) + " distances for " +
                                 std::to_string(frames) + " frames.");
  for (size_t m = 0; m < volume.motions.size(); ++m) {
    const Motion& motion = volume.motions[m];
    if (motion.steps.size() != size_t(volume.times.steps()))
      return refused(volume, "its motion \"" + motion.name + "\" has " +
                                 std::to_string(motion.steps.size()) + " fields, but there are " +
                                 std::to_string(volume.times.steps()) +
                                 " steps between its frames.");
    for (size_t other = 0; other < m; ++other)
      if (volume.motions[other].name == motion.name)
        return refused(volume, "two of its motions are called \"" + motion.name + "\".");
  }
  return Nothing{};
}

bool can_blend(const MovingVolume& from, const MovingVolume& to) {
  if (!from.whole || !to.whole || from.frames != to.frames) return false;
  const TimeBasis &a = from.whole->basis(), &b = to.whole->basis();
  return from.whole->reference() == to.whole->reference() && a.times_s == b.times_s &&
         a.cycle_s == b.cycle_s;
}

}  // namespace palpate
