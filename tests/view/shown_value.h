#pragma once

#include "module/haptics/proxy/back_track.h"
#include "module/scene/moving_volume.h"

namespace palpate::test {

/// The value that the haptic loop reads at a place x (volume space, m) with the frame pointer `at`:
/// back-tracked by module/haptics and blended by equation (24), or carried by one motion for all
/// times. The oracle of the picture. Without the closing of cycles.
inline double felt_value(const MovingVolume& volume, FramePointer at, glm::dvec3 x) {
  if (volume.whole) {
    SequenceSnapshot snapshot(*volume.whole, volume.whole->basis().at(at.frame, at.phase));
    return volume.frames[0]->scalar(back_track(snapshot, x, x - snapshot.displacement(x)).x_m);
  }
  const int frames = int(volume.frames.size());
  const FrameData& frame = *volume.frames[size_t(at.frame)];
  const FrameData& next = *volume.frames[size_t((at.frame + 1) % frames)];
  if (at.phase <= 0.0) return frame.scalar(x);
  const MotionMap* map =
      volume.motions.empty() ? nullptr : volume.motions[0].steps[size_t(at.frame)].get();
  if (!map) return (1.0 - at.phase) * frame.scalar(x) + at.phase * next.scalar(x);
  const BackTrack found = back_track(*map, at.phase, x, x - at.phase * map->displacement(x));
  return (1.0 - at.phase) * frame.scalar(found.x_m) +
         at.phase * next.scalar(found.x_m + found.at.u_m);
}

}  // namespace palpate::test
