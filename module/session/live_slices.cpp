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
    std::shared_ptr<const OrthogonalSlices> slices;
    // Without memory for them the window goes on without slices.
    const Status sampled = caught([&]() -> Status {
      picture_.choose(wanted->choices);
      picture_.update(session_.scene());
      if (auto found = picture_.slices(wanted->snapshot, wanted->edge_px))
        slices = std::make_shared<const OrthogonalSlices>(std::move(*found));
      return Nothing{};
    });
    const auto took = Clock::now() - start;
    std::unique_lock lock(mutex_);
    newest_ = sampled ? std::move(slices) : nullptr;
    const auto next = start + std::max<Clock::duration>(kBetweenSlices, kShareOfTime * took);
    changed_.wait_until(lock, next, [this] { return ends_; });
  }
}

}  // namespace palpate
