#include "module/session/live_picture.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

constexpr PictureSize kMost{2560, 1600};
constexpr ResolutionOptions kResolution{.budget_s = 1.0 / 25.0, .least = 0.35};
constexpr double kAtFirst = 0.4;  // scale of the first picture, which comes soon
constexpr std::chrono::milliseconds kLiveFrame{16};
constexpr std::chrono::milliseconds kNoWindow{2};

// While nothing moves: of how many pictures a mean is taken, and how long each may take, since what
// the user does next has to wait for it.
constexpr int kMostAveraged = 16;
constexpr double kStill_s = 0.2;

// Pictures so much larger are worth beginning anew.
constexpr double kLarger = 1.2;

PictureSize within(PictureSize size, PictureSize most) {
  const double share =
      std::min({1.0, double(most.width) / size.width, double(most.height) / size.height});
  return {int(size.width * share), int(size.height * share)};
}

}  // namespace

LivePicture::LivePicture(Session& session, const vulkan::ContextOptions& gpu, int eyes)
    : session_(session),
      resolution_{.scale = kAtFirst},
      thread_(session,
              {.gpu = gpu,
               .choices = {},
               .renderer = {.most = kMost, .most_eyes = eyes},
               .reader = SnapshotReader::kWindow},
              [this](Viewer& viewer, const SceneSnapshot& snapshot, bool) {
                return draw(viewer, snapshot);
              }) {}

void LivePicture::want(const WantedPicture& wanted) {
  const std::lock_guard lock(mutex_);
  wanted_ = wanted;
}

std::shared_ptr<const LiveFrame> LivePicture::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

Result<std::chrono::milliseconds> LivePicture::draw(Viewer& viewer, const SceneSnapshot& snapshot) {
  WantedPicture wanted;
  {
    const std::lock_guard lock(mutex_);
    wanted = wanted_;
  }
  if (wanted.size.width < 1 || wanted.size.height < 1) return kNoWindow;
  viewer.choose(wanted.choices);
  if (const Status set = viewer.update(session_); !set) return set.error();
  const PictureSize most = within(wanted.size, kMost);
  // The picture appears when it is done, in about the time that the last one took.
  const int64_t seen_ns =
      snapshot.now_ns + int64_t(1e9 * resolution_.full_s * resolution_.scale * resolution_.scale);
  const Stereo stereo = wanted.choices.stereo.value_or(Stereo::kMono);
  std::array<Eye, 2> both{wanted.eye, wanted.eye};
  if (stereo != Stereo::kMono) both = eyes_of_head(wanted.eye, wanted.distance_m);
  const std::span<const Eye> eyes(both.data(), stereo == Stereo::kMono ? 1U : 2U);
  LastDrawn drawn{viewer.scene_at(snapshot, seen_ns, eyes), both, most, stereo};
  const bool is_still = drawn_ == drawn;
  drawn_ = std::move(drawn);
  auto frame = std::make_shared<LiveFrame>();
  frame->eye = wanted.eye;
  frame->snapshot = snapshot;
  frame->tube_colours = drawn_->scene.tube_colours;
  if (is_still && means_[0].count() >= kMostAveraged) {
    const std::lock_guard lock(mutex_);
    frame->picture = newest_->picture;
    frame->averaged = newest_->averaged;
    frame->picture_s = newest_->picture_s;
    newest_ = std::move(frame);
    return kLiveFrame;
  }
  const auto drawing = Clock::now();
  double scale = resolution_.scale;
  if (is_still) {
    // The first picture took longer than others will: kernels were compiled, and bricks made.
    scale = std::clamp(std::sqrt(kStill_s / full_s_), scale, 1.0);
    if (scale > kLarger * mean_scale_) mean_scale_ = 0.0;
  }
  if (!is_still || mean_scale_ == 0.0) {
    for (PictureMean& mean : means_) mean.clear();
    mean_scale_ = is_still ? scale : 0.0;
  }
  if (is_still) scale = mean_scale_;
  auto pictures = viewer.take_one_of(drawn_->scene, means_[0].count(), eyes, scaled(most, scale));
  if (!pictures) return pictures.error();
  frame->picture_s = std::chrono::duration<double>(Clock::now() - drawing).count();
  full_s_ = frame->picture_s / (scale * scale);
  if (is_still) {
    for (size_t e = 0; e < eyes.size(); ++e) {
      means_[e].add((*pictures)[e]);
      (*pictures)[e] = means_[e].mean();
    }
    frame->averaged = means_[0].count();
  } else {
    resolution_ = next_resolution(resolution_, frame->picture_s, kResolution);
  }
  frame->picture = std::make_shared<const Picture>(
      stereo == Stereo::kMono
          ? std::move(pictures->front())
          : joined({std::move((*pictures)[0]), std::move((*pictures)[1])}, stereo));
  const std::lock_guard lock(mutex_);
  newest_ = std::move(frame);
  return kLiveFrame;
}

}  // namespace palpate
