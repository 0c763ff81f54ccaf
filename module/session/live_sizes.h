#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <thread>

#include "module/session/segment_sizes.h"

namespace palpate {

/// Sizes of the segments of a volume that a window shows, measured on a thread of low priority that
/// ends with its result. Measured again where the volume is another one, as when motion arrives.
class LiveSizes {
 public:
  /// Starts to measure, unless this volume is measured already or another one still is. One thread.
  void want(const std::shared_ptr<const MovingVolume>& volume);
  /// The last ones; null before the first. Any thread.
  std::shared_ptr<const SegmentSizes> newest() const;

 private:
  std::shared_ptr<const MovingVolume> wanted_;  ///< measured, or being measured
  std::atomic<bool> busy_{false};
  mutable std::mutex mutex_;  ///< of newest_
  std::shared_ptr<const SegmentSizes> newest_;
  std::jthread thread_;  ///< the last member: it ends before what it uses
};

}  // namespace palpate
