#include "integration/app/gallery.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "integration/app/still_picture.h"
#include "integration/files/sentences.h"
#include "module/haptics/real_time.h"

namespace palpate::app {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kFrame{33};
constexpr std::chrono::milliseconds kStillFrame{500};  // while motion is estimated: let it

constexpr double kStronger = 1.2;  // force, of one picture to another that is as good

bool moves(const SceneMoment& moment) {
  return std::any_of(moment.volumes.begin(), moment.volumes.end(),
                     [](const VolumeMoment& volume) { return volume.rate != 0.0; });
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace

Gallery::Gallery(Session& session, const GalleryOptions& options, Console& console)
    : session_(session),
      options_(options),
      console_(console),
      kept_(size_t(options.pictures)),
      thread_([this](std::stop_token stop) { run(stop); }) {}

Gallery::~Gallery() {
  stop();
}

void Gallery::stop() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

double Gallery::median_ms() const {
  if (frame_ms_.empty()) return 0.0;
  std::vector<double> sorted = frame_ms_;
  std::nth_element(sorted.begin(), sorted.begin() + sorted.size() / 2, sorted.end());
  return sorted[sorted.size() / 2];
}

void Gallery::run(std::stop_token stop) {
  give_way(BackgroundWork::kPictures);
  const Status looked = look(stop);
  if (!looked) trouble_ = looked.error().message;
}

Status Gallery::look(std::stop_token stop) {
  const auto begin = Clock::now();
  auto opened = StillPicture::open(options_.gpu, options_.view, options_.size, 2);
  if (!opened) return opened.error();
  StillPicture& still = **opened;
  SceneMoment moment;
  while (!stop.stop_requested()) {
    const auto start = Clock::now();
    if (!session_.newest(MomentReader::kPictures, moment) || moment.volume_count == 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      continue;
    }
    auto pictures = still.take(session_.scene(), moment, session_.tubes());
    if (!pictures) return pictures.error();
    frame_ms_.push_back(1e3 * seconds_since(start));
    if (first_picture_s_ == 0.0) first_picture_s_ = seconds_since(begin);
    keep(moment, *pictures, still.scene());
    std::this_thread::sleep_until(start + (moves(moment) ? kFrame : kStillFrame));
  }
  return Nothing{};
}

/// One picture per stretch of the cycle: one while touching and moving is better than one of the
/// still frame, and that better than one in free space; of two alike, one where far more is felt.
void Gallery::keep(const SceneMoment& moment, const std::vector<charts::Raster>& pictures,
                   const ViewScene& scene) {
  size_t bin = 0;
  double pointer = 0.0;
  const bool moving = moves(moment);
  for (size_t v = 0; v < scene.volumes.size(); ++v) {
    const MovingVolume& volume = *scene.volumes[v].data;
    if (volume.is_still()) continue;
    pointer = scene.volumes[v].pointer.frame + scene.volumes[v].pointer.phase;
    const double share = pointer / double(std::max(1, volume.times.steps()));
    bin = std::min(kept_.size() - 1, size_t(share * double(kept_.size())));
    break;
  }
  Kept& kept = kept_[bin];
  const int worth = 2 * moment.in_contact + moving, before = 2 * kept.touching + kept.moving;
  const double force_n = glm::length(moment.force_n);
  const bool stronger = worth == before && force_n > kStronger * kept.force_n;
  if (kept.any && worth <= before && !stronger) return;
  kept.any = true;
  kept.touching = moment.in_contact;
  kept.moving = moving;
  kept.view.left = pictures[0];
  kept.view.right = pictures[1];
  kept.view.label = fmt::format("frame {:.2f}", pointer);
  kept.force_n = force_n;
  kept.view.sublabel = fmt::format("{:.2f} N", force_n);
}

Status Gallery::stage(Outputs& outputs, const std::string& title, const std::string& subtitle,
                      const charts::Timeline& timeline) const {
  charts::FeltPage page{title, subtitle, {}, timeline};
  for (const Kept& kept : kept_)
    if (kept.any) page.views.push_back(kept.view);
  for (size_t v = 0; v < page.views.size(); ++v) {
    const auto path = outputs.stage(fmt::format("view_{}.png", v + 1));
    if (!path) return path.error();
    const Status written = charts::write_stereo_view(path->string(), page.views[v]);
    if (!written) return outputs.in_place(written.error());
  }
  const auto path = outputs.stage("page.png");
  if (!path) return path.error();
  const Status written = charts::write_felt_page(path->string(), page);
  return written ? written : Status(outputs.in_place(written.error()));
}

}  // namespace palpate::app
