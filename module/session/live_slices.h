#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>

#include "module/session/scene_picture.h"
#include "module/session/session.h"

namespace palpate {

/// The next slices to sample.
struct WantedSlices {
  SceneSnapshot snapshot;
  ViewChoices choices;
  int edge_px = 0;
};

/// Slices of a running scene for a window, sampled on another thread of low priority: at most five
/// times a second, not longer than a quarter of the time, and only where something has changed.
class LiveSlices {
 public:
  /// Starts at once and samples from the first want() on. `session` is borrowed.
  explicit LiveSlices(Session& session);
  LiveSlices(const LiveSlices&) = delete;
  LiveSlices& operator=(const LiveSlices&) = delete;
  /// Waits for the slices that are being sampled.
  ~LiveSlices();

  /// Takes effect with the next slices. Any thread.
  void want(const WantedSlices& wanted);
  /// The last ones sampled; null before the first, and where there is nothing to slice. Any thread.
  std::shared_ptr<const OrthogonalSlices> newest() const;

 private:
  void run();
  bool is_as_before(const WantedSlices& wanted, const Scene* scene) const;

  Session& session_;
  ScenePicture picture_{ViewChoices{}};
  WantedSlices sampled_;                ///< what the last slices show; edge_px is 0 before
  std::shared_ptr<const Scene> scene_;  ///< of them
  mutable std::mutex mutex_;            ///< of what follows but the thread
  std::condition_variable changed_;
  std::unique_ptr<WantedSlices> wanted_;
  std::shared_ptr<const OrthogonalSlices> newest_;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace palpate
