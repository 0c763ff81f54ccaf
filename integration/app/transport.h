#pragma once

#include <atomic>
#include <mutex>
#include <vector>

#include "integration/app/palpation.h"

namespace palpate::app {

/// Play, pause and scrub, for whoever has the button: a key in the window, a controller. Any
/// thread.
class Transport {
 public:
  /// `palpation` is borrowed.
  explicit Transport(Palpation& palpation) : palpation_(palpation) {}

  /// Until then nothing moves: motion is awaited.
  void allow() { allowed_ = true; }
  bool allowed() const { return allowed_; }

  void toggle();
  /// By a share of each sequence from where it is in `moment`, or from where the scrub before took
  /// it, which no picture may have shown yet; pauses.
  void scrub(const SceneMoment& moment, double share);

 private:
  void play(bool on);

  Palpation& palpation_;
  std::atomic<bool> allowed_{false}, playing_{true};
  std::mutex mutex_;
  std::vector<double> scrubbed_s_;  ///< per volume; empty: not since it played
};

}  // namespace palpate::app
