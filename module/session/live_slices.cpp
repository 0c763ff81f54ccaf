#include "module/session/live_slices.h"

#include <algorithm>
#include <chrono>

#include "compute/vulkan/caught.h"
#include "module/haptics/servo/real_time.h"

namespace palpate {
namespace {

constexpr std::chrono::milliseconds kBetweenSlices{200};
constexpr int kShareOfTime = 4;  // one of so many parts

}  // namespace

LiveSlices::LiveSlices(Session& session) : session_(session), thread_([this] { run(); }) {}

LiveSlices::~LiveSlices() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void LiveSlices::want(const WantedSlices& wanted) {
  {
    const std::lock_guard lock(mutex_);
    wanted_ = std::make_unique<WantedSlices>(wanted);
  }
  changed_.notify_all();
}

std::shared_ptr<const OrthogonalSlices> LiveSlices::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

/// Whether the same would be sampled again.
bool LiveSlices::is_as_before(const WantedSlices& wanted, const Scene* scene) const {
  const SceneSnapshot &now = wanted.snapshot, &then = sampled_.snapshot;
  if (scene != scene_.get() || wanted.edge_px != sampled_.edge_px ||
      wanted.choices != sampled_.choices || now.volume_count != then.volume_count ||
      now.proxy_m != then.proxy_m)
    return false;
  for (int v = 0; v < now.volume_count; ++v)
    if (now.volumes[size_t(v)].time_s != then.volumes[size_t(v)].time_s ||
        now.volumes[size_t(v)].world_from_volume != then.volumes[size_t(v)].world_from_volume)
      return false;
  return true;
}

void LiveSlices::run() {
  using Clock = std::chrono::steady_clock;
  give_way(BackgroundWork::kPictures);
  while (true) {
    std::unique_ptr<WantedSlices> wanted;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return ends_ || wanted_; });
      if (ends_) return;
      wanted = std::move(wanted_);
    }
    const auto start = Clock::now();
    const auto scene = session_.scene();
    if (is_as_before(*wanted, scene.get())) {
      std::unique_lock lock(mutex_);
      changed_.wait_until(lock, start + kBetweenSlices, [this] { return ends_; });
      continue;
    }
    std::shared_ptr<const OrthogonalSlices> slices;
    // Without memory for them the window goes on without slices.
    const Status sampled = caught([&]() -> Status {
      picture_.choose(wanted->choices);
      picture_.update(scene);
      if (auto found = picture_.slices(wanted->snapshot, wanted->edge_px))
        slices = std::make_shared<const OrthogonalSlices>(std::move(*found));
      return Nothing{};
    });
    sampled_ = *wanted;
    scene_ = scene;
    const auto took = Clock::now() - start;
    std::unique_lock lock(mutex_);
    newest_ = sampled ? std::move(slices) : nullptr;
    const auto next = start + std::max<Clock::duration>(kBetweenSlices, kShareOfTime * took);
    changed_.wait_until(lock, next, [this] { return ends_; });
  }
}

}  // namespace palpate
