#include "module/session/gallery.h"

#include <algorithm>

namespace palpate {
namespace {

constexpr std::chrono::milliseconds kGalleryFrame{33};
constexpr std::chrono::milliseconds kStillFrame{500};  // time for the estimation of motion
constexpr std::chrono::milliseconds kNothingNew{1};    // no new snapshot

// ratio of forces above which a picture replaces an equally good one
constexpr double kStronger = 1.2;

bool moves(const SceneSnapshot& snapshot) {
  return std::any_of(snapshot.volumes.begin(), snapshot.volumes.end(),
                     [](const VolumeSnapshot& volume) { return volume.rate != 0.0; });
}

}  // namespace

Gallery::Gallery(Session& session, const GalleryOptions& options)
    : session_(session),
      options_(options),
      kept_(size_t(options.pictures)),
      thread_(session,
              {.gpu = options.gpu,
               .choices = options.view,
               .renderer = {.most = options.size, .most_eyes = 2},
               .reader = SnapshotReader::kPictures},
              [this](Viewer& viewer, const SceneSnapshot& snapshot,
                     bool is_new) -> Result<std::chrono::milliseconds> {
                if (!is_new) return kNothingNew;
                return draw(viewer, snapshot);
              }) {}

size_t Gallery::frames() const {
  const std::lock_guard lock(mutex_);
  return frame_ms_.size();
}

double Gallery::first_picture_s() const {
  const std::lock_guard lock(mutex_);
  return first_picture_s_;
}

double Gallery::median_ms() const {
  const std::lock_guard lock(mutex_);
  if (frame_ms_.empty()) return 0.0;
  std::vector<double> sorted = frame_ms_;
  std::nth_element(sorted.begin(), sorted.begin() + sorted.size() / 2, sorted.end());
  return sorted[sorted.size() / 2];
}

std::vector<StereoPicture> Gallery::pictures() const {
  const std::lock_guard lock(mutex_);
  std::vector<StereoPicture> pictures;
  for (const Kept& kept : kept_)
    if (kept.any) pictures.push_back(kept.picture);
  return pictures;
}

Result<std::chrono::milliseconds> Gallery::draw(Viewer& viewer, const SceneSnapshot& snapshot) {
  const auto start = Clock::now();
  const auto seconds_since = [](Clock::time_point then) {
    return std::chrono::duration<double>(Clock::now() - then).count();
  };
  if (const Status set = viewer.update(session_); !set) return set.error();
  auto pictures = viewer.take_all(snapshot, options_.size, 2);
  if (!pictures) return pictures.error();
  const std::lock_guard lock(mutex_);
  frame_ms_.push_back(1e3 * seconds_since(start));
  if (first_picture_s_ == 0.0) first_picture_s_ = seconds_since(begin_);
  keep(snapshot, viewer.shown(), std::move(*pictures));
  return moves(snapshot) ? kGalleryFrame : kStillFrame;
}

/// Call with mutex_ locked. Keeps one picture per part of the cycle. A picture with contact in
/// motion is better than one of the still frame, and that is better than one in free space; of two
/// equally good ones the one with a much larger force is kept.
void Gallery::keep(const SceneSnapshot& snapshot, const ViewScene& scene,
                   std::vector<Picture> pictures) {
  size_t bin = 0;
  double pointer = 0.0;
  const bool moving = moves(snapshot);
  for (size_t v = 0; v < scene.volumes.size(); ++v) {
    const MovingVolume& volume = *scene.volumes[v].data;
    if (volume.is_still()) continue;
    pointer = scene.volumes[v].pointer.frame + scene.volumes[v].pointer.phase;
    const double share = pointer / double(std::max(1, volume.times.steps()));
    bin = std::min(kept_.size() - 1, size_t(share * double(kept_.size())));
    break;
  }
  Kept& kept = kept_[bin];
  const int worth = 2 * snapshot.in_contact + moving, before = 2 * kept.touching + kept.moving;
  const double force_n = glm::length(snapshot.force_n);
  const bool stronger = worth == before && force_n > kStronger * kept.picture.force_n;
  if (kept.any && worth <= before && !stronger) return;
  kept = {true, snapshot.in_contact, moving, {}};
  kept.picture = {{std::move(pictures[0]), std::move(pictures[1])},
                  snapshot,
                  pointer,
                  force_n,
                  scene.tube_colours};
}

}  // namespace palpate
