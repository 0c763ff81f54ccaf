#include "module/session/live_picture.h"

#include <algorithm>
#include <chrono>

#include "compute/vulkan/caught.h"
#include "module/haptics/real_time.h"
#include "module/view/resolution.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

constexpr PictureSize kMost{2560, 1600};
constexpr ResolutionOptions kResolution{.budget_s = 1.0 / 25.0, .least = 0.35};
constexpr double kAtFirst = 0.4;  // of the size: a slow device shows something soon
constexpr std::chrono::milliseconds kFrame{16};
constexpr std::chrono::milliseconds kPause{2};

PictureSize within(PictureSize size, PictureSize most) {
  const double share =
      std::min({1.0, double(most.width) / size.width, double(most.height) / size.height});
  return {int(size.width * share), int(size.height * share)};
}

}  // namespace

LivePicture::LivePicture(Session& session, const vulkan::ContextOptions& gpu)
    : session_(session), gpu_(gpu), thread_([this](std::stop_token stop) { run(stop); }) {}

LivePicture::~LivePicture() = default;

void LivePicture::want(const WantedPicture& wanted) {
  const std::lock_guard lock(mutex_);
  wanted_ = wanted;
}

std::shared_ptr<const LiveFrame> LivePicture::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

std::string LivePicture::trouble() const {
  const std::lock_guard lock(mutex_);
  return trouble_;
}

void LivePicture::run(std::stop_token stop) {
  give_way(BackgroundWork::kPictures);
  const Status drawn = caught([&] { return draw(stop); });
  if (drawn) return;
  const std::lock_guard lock(mutex_);
  trouble_ = drawn.error().message;
}

Status LivePicture::draw(std::stop_token stop) {
  const auto context = vulkan::Context::open(gpu_);
  if (!context) return context.error();
  auto opened = Viewer::open(*context, ViewChoices{}, {.most = kMost, .most_eyes = 1});
  if (!opened) return opened.error();
  Viewer& viewer = **opened;
  Resolution resolution{.scale = kAtFirst};
  SceneMoment moment;
  while (!stop.stop_requested()) {
    const auto start = Clock::now();
    WantedPicture wanted;
    {
      const std::lock_guard lock(mutex_);
      wanted = wanted_;
    }
    session_.newest(MomentReader::kWindow, moment);
    if (wanted.size.width < 1 || wanted.size.height < 1 || moment.volume_count == 0) {
      std::this_thread::sleep_for(kPause);
      continue;
    }
    viewer.choose(wanted.choices);
    if (const Status set = viewer.update(session_.scene()); !set) return set;
    viewer.show(session_.tubes());
    const PictureSize size = scaled(within(wanted.size, kMost), resolution.scale);
    // It is seen when it is done, as long from now as the last one took.
    const int64_t seen_ns =
        moment.now_ns + int64_t(1e9 * resolution.full_s * resolution.scale * resolution.scale);
    const auto drawing = Clock::now();
    if (const Status started = viewer.start(moment, seen_ns, {&wanted.eye, 1}, size); !started)
      return started;
    auto picture = viewer.renderer().read_back(0);
    if (!picture) return picture.error();
    auto frame = std::make_shared<LiveFrame>();
    frame->picture = std::move(*picture);
    frame->eye = wanted.eye;
    frame->moment = moment;
    frame->picture_s = std::chrono::duration<double>(Clock::now() - drawing).count();
    resolution = next_resolution(resolution, frame->picture_s, kResolution);
    {
      const std::lock_guard lock(mutex_);
      newest_ = std::move(frame);
    }
    std::this_thread::sleep_until(start + kFrame);
  }
  return viewer.renderer().wait();
}

}  // namespace palpate
