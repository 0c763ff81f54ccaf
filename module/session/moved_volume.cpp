#include "module/session/moved_volume.h"

#include <limits>

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

MovedReader::MovedReader(const MovingVolume& volume, double time_s)
    : volume_(volume),
      pointer_(pointer_at(volume.times, time_s)),
      frame_(volume.whole ? 0 : size_t(pointer_.frame)),
      next_((frame_ + 1) % volume.frames.size()) {
  if (!volume.whole && !volume.motions.empty() && frame_ < volume.motions[0].steps.size())
    map_ = volume.motions[0].steps[frame_].get();
  if (volume.whole) whole_.emplace(*volume.whole, volume.whole->basis().at(time_s));
}

glm::dvec3 MovedReader::material_at(glm::dvec3 y_m) {
  if (whole_) return back_track(*whole_, y_m, y_m).x_m;
  return map_ ? back_track(*map_, pointer_.phase, y_m, y_m).x_m : y_m;
}

double MovedReader::value(glm::dvec3 x_m) const {
  const double value = volume_.frames[frame_]->scalar(x_m);
  if (whole_ || !(pointer_.phase > 0.0)) return value;
  const glm::dvec3 there = x_m + (map_ ? map_->displacement(x_m) : glm::dvec3(0.0));
  return value + pointer_.phase * (volume_.frames[next_]->scalar(there) - value);
}

double MovedReader::distance_mm(const Segment& segment, glm::dvec3 x_m) const {
  // One alone is that of the volume's segments_frame, or of the frame that one motion carries.
  const bool is_one = segment.distance_mm.size() == 1;
  const size_t at = is_one ? 0 : frame_;
  const bool is_known =
      at < segment.distance_mm.size() &&
      (!is_one || whole_ || volume_.frames.size() == 1 || volume_.segments_frame == frame_);
  return is_known ? segment.distance_mm[at]->scalar(x_m) : std::numeric_limits<double>::quiet_NaN();
}

MovedVolume moved_volume(const MovingVolume& volume, double time_s, size_t most_samples,
                         std::stop_token stop) {
  MovedVolume moved;
  const ScalarSamples samples = volume.frames.front()->samples();
  if (!samples.place) return moved;
  MovedReader reader(volume, time_s);
  moved.values.grid = grid_of(*samples.place, most_samples);
  const Grid& grid = moved.values.grid;
  moved.values.values.reserve(grid.count());
  moved.moved_mm.reserve(grid.count());
  for (int k = 0; k < grid.size.z && !stop.stop_requested(); ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        // The material that is at y now was at x in its frame.
        const glm::dvec3 y = volume_from_lps(grid.lps_from_index({i, j, k}));
        const glm::dvec3 x = reader.material_at(y);
        moved.values.values.push_back(float(reader.value(x)));
        moved.moved_mm.emplace_back(lps_from_volume(y - x));
      }
  return moved;
}

}  // namespace palpate
