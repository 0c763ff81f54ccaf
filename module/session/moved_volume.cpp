#include "module/session/moved_volume.h"

#include <optional>

#include "module/haptics/proxy/back_track.h"
#include "module/scene/playback.h"

namespace palpate {
namespace {

Grid grid_of(const GridPlace& place, size_t most_samples) {
  const glm::dmat3 volume_from_index = glm::inverse(place.index_from_volume);
  int stride = 1;
  const auto size = [&] { return (place.size + stride - 1) / stride; };
  while (size_t(size().x) * size_t(size().y) * size_t(size().z) > most_samples) ++stride;
  Grid grid;
  grid.size = size();
  grid.origin_mm = lps_from_volume(volume_from_index * -place.offset);
  for (int a = 0; a < 3; ++a) {
    const glm::dvec3 axis = double(stride) * lps_from_volume(volume_from_index[a]);
    grid.spacing_mm[a] = glm::length(axis);
    grid.direction[a] = axis / grid.spacing_mm[a];
  }
  return grid;
}

}  // namespace

MovedVolume moved_volume(const MovingVolume& volume, double time_s, size_t most_samples,
                         std::stop_token stop) {
  MovedVolume moved;
  const ScalarSamples samples = volume.frames.front()->samples();
  if (!samples.place) return moved;
  const FramePointer pointer = pointer_at(volume.times, time_s);
  const size_t frame = volume.whole ? 0 : size_t(pointer.frame);
  const size_t next = (frame + 1) % volume.frames.size();
  const MotionMap* map = nullptr;
  if (!volume.whole && !volume.motions.empty() && frame < volume.motions[0].steps.size())
    map = volume.motions[0].steps[frame].get();
  std::optional<SequenceSnapshot> whole;
  if (volume.whole) whole.emplace(*volume.whole, volume.whole->basis().at(time_s));
  moved.values.grid = grid_of(*samples.place, most_samples);
  const Grid& grid = moved.values.grid;
  moved.values.values.reserve(grid.count());
  moved.moved_mm.reserve(grid.count());
  const FrameData &a = *volume.frames[frame], &b = *volume.frames[next];
  for (int k = 0; k < grid.size.z && !stop.stop_requested(); ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        // The material that is at y now was at x in its frame.
        const glm::dvec3 y = volume_from_lps(grid.lps_from_index({i, j, k}));
        glm::dvec3 x = y;
        if (whole)
          x = back_track(*whole, y, y).x_m;
        else if (map)
          x = back_track(*map, pointer.phase, y, y).x_m;
        double value = a.scalar(x);
        if (!whole && pointer.phase > 0.0) {
          const glm::dvec3 there = x + (map ? map->displacement(x) : glm::dvec3(0.0));
          value += pointer.phase * (b.scalar(there) - value);
        }
        moved.values.values.push_back(float(value));
        moved.moved_mm.emplace_back(lps_from_volume(y - x));
      }
  return moved;
}

}  // namespace palpate
