#include "module/session/loaded_scene.h"

#include <algorithm>

#include "compute/volume/heart_phantom.h"
#include "module/scene/make_volume.h"

namespace palpate {

std::optional<Note> times_note(const MovingVolume& volume, bool of_scene_file) {
  // From a mouse's heart to a breath that is held for a while.
  constexpr double kShortestCycle_s = 0.08, kLongestCycle_s = 15.0;
  if (!volume.times.assumed) {
    const double cycle_s = volume.times.cycle_s;
    const bool beats = cycle_s >= kShortestCycle_s && cycle_s <= kLongestCycle_s;
    if (of_scene_file || !volume.times.cyclic() || beats || volume.is_still() ||
        volume.frames.front()->is_vector())
      return std::nullopt;
    return Note{NoteKind::kOddCycle, {cycle_s, 60.0 / cycle_s}, {volume.name}};
  }
  const auto frames = double(volume.times.times_s.size());
  const double step_s = volume.times.times_s[1] - volume.times.times_s[0];
  return Note{
      NoteKind::kAssumedTimes,
      {frames, frames * step_s},
      {volume.name, of_scene_file ? "frames_per_second in the scene" : "`frames_per_second`"}};
}

void forget_motion(LoadedScene& scene) {
  for (size_t v = 0; v < scene.data.size(); ++v) {
    const std::string source = scene.spec.volumes[v].source;
    if (source != "heart" && source != "shell") continue;
    MovingVolume volume = *scene.data[v];
    volume.motions.clear();
    scene.missing.push_back(
        {v,
         [source, count = int(volume.frames.size())]() -> Result<Frames> {
           const Grid grid = heart_grid(128);
           auto made =
               std::make_shared<Sequence>(source == "heart" ? heart_phantom(grid, count, 1, 0.0)
                                                            : shell_phantom(grid, count, 1, 0.0));
           Frames frames;
           frames.name = source;
           frames.grid = made->frames.front().grid;
           frames.count = made->frames.size();
           frames.read = [made](size_t k) -> Result<Volume> { return std::move(made->frames[k]); };
           return frames;
         },
         nullptr});
    scene.data[v] = std::make_shared<const MovingVolume>(std::move(volume));
  }
}

void make_movable(LoadedScene& scene) {
  for (VolumeSpec& volume : scene.spec.volumes) {
    if (volume.drive.kind != DriveSpec::Kind::kStill) continue;
    volume.drive.kind = DriveSpec::Kind::kSecondHand;
    volume.path = usual_path(volume.drive.kind);
  }
}

double fit_to_reach(LoadedScene& scene, const DeviceInfo& device) {
  VolumeSpec& spec = scene.spec.volumes.front();
  const FrameData& frame = *scene.data.front()->frames.front();
  const double scale = scale_to_reach(frame, device.workspace_radius_m);
  if (!(scale < 1.0)) return 1.0;
  const glm::dvec3 middle = 0.5 * (frame.low_m() + frame.high_m());
  const glm::dvec3 world = spec.transform.world_from_volume(middle);
  spec.transform.scale *= scale;
  spec.transform.translation_m = world - spec.transform.rotation * (spec.transform.scale * middle);
  scene.notes.push_back({NoteKind::kScaledDown, {scale}, {}});
  return scale;
}

}  // namespace palpate
