#include "module/session/live_picture.h"

#include <algorithm>
#include <chrono>

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

constexpr PictureSize kMost{2560, 1600};
constexpr ResolutionOptions kResolution{.budget_s = 1.0 / 25.0, .least = 0.35};
constexpr double kAtFirst = 0.4;  // scale of the first picture, which comes soon
constexpr std::chrono::milliseconds kLiveFrame{16};
constexpr std::chrono::milliseconds kNoWindow{2};

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
  const PictureSize size = scaled(within(wanted.size, kMost), resolution_.scale);
  // The picture appears when it is done, in about the time that the last one took.
  const int64_t seen_ns =
      snapshot.now_ns + int64_t(1e9 * resolution_.full_s * resolution_.scale * resolution_.scale);
  const auto drawing = Clock::now();
  const Stereo stereo = wanted.choices.stereo.value_or(Stereo::kMono);
  std::array<Eye, 2> eyes{wanted.eye, wanted.eye};
  if (stereo != Stereo::kMono) eyes = eyes_of_head(wanted.eye, wanted.distance_m);
  auto pictures =
      viewer.take(snapshot, seen_ns, {eyes.data(), stereo == Stereo::kMono ? 1U : 2U}, size);
  if (!pictures) return pictures.error();
  auto frame = std::make_shared<LiveFrame>();
  frame->picture = stereo == Stereo::kMono
                       ? std::move(pictures->front())
                       : joined({std::move((*pictures)[0]), std::move((*pictures)[1])}, stereo);
  frame->eye = wanted.eye;
  frame->snapshot = snapshot;
  frame->tube_colours = viewer.shown().tube_colours;
  frame->picture_s = std::chrono::duration<double>(Clock::now() - drawing).count();
  resolution_ = next_resolution(resolution_, frame->picture_s, kResolution);
  const std::lock_guard lock(mutex_);
  newest_ = std::move(frame);
  return kLiveFrame;
}

}  // namespace palpate
