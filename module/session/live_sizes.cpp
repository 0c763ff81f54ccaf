#include "module/session/live_sizes.h"

#include "compute/vulkan/caught.h"
#include "module/haptics/servo/real_time.h"

namespace palpate {

void LiveSizes::want(const std::shared_ptr<const MovingVolume>& volume) {
  if (busy_ || volume == wanted_ || volume->segments.empty()) return;
  wanted_ = volume;
  busy_ = true;
  thread_ = std::jthread([this, volume](std::stop_token stop) {
    give_way(BackgroundWork::kPictures);
    // Without memory for them the window goes on without sizes.
    static_cast<void>(caught([&]() -> Status {
      auto sizes = std::make_shared<const SegmentSizes>(segment_sizes(*volume, stop));
      const std::lock_guard lock(mutex_);
      if (!stop.stop_requested()) newest_ = std::move(sizes);
      return Nothing{};
    }));
    busy_ = false;
  });
}

std::shared_ptr<const SegmentSizes> LiveSizes::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

}  // namespace palpate
