#pragma once

#include <atomic>
#include <string>

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
  /// By a share of each sequence from where it is in `moment`; pauses.
  void scrub(const SceneMoment& moment, double share);

 private:
  void play(bool on);

  Palpation& palpation_;
  std::atomic<bool> allowed_{false}, playing_{true};
};

}  // namespace palpate::app
