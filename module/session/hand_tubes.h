#pragma once

#include <memory>
#include <string>
#include <vector>

#include "module/haptics/scene/hand_commands.h"
#include "module/session/stream_tube.h"

namespace palpate {

/// A stream tube that the user has released.
struct ReleasedTube {
  size_t volume = 0;  ///< of the scene
  bool kept = false;
  std::shared_ptr<const StreamTube> tube;
};
using ReleasedTubes = std::vector<ReleasedTube>;

/// The stream tubes of a hand: released, kept and cleared by its commands, and transferred when the
/// scene gets other data. One thread; the result of tubes() may be used on any.
class HandTubes {
 public:
  /// above this number the oldest one that is not kept is removed
  static constexpr size_t kMost = 64;

  /// Executes a command. A new tube follows tube_field() of the first volume with such a field
  /// around the hand. Returns a sentence for the user if that is not possible; else empty.
  std::string take(const HandCommand& command, const Scene& scene);
  /// Transfers the tubes to the scene's new data, which agree with the former ones at `now`. Tubes
  /// that can not be transferred are removed; the returned sentence says so.
  std::string follow(const Scene& scene, const SceneSnapshot& now);

  /// Never null.
  std::shared_ptr<const ReleasedTubes> tubes() const { return tubes_; }

 private:
  std::string release(const Scene& scene, const SceneSnapshot& snapshot);
  void clear();

  std::shared_ptr<const ReleasedTubes> tubes_ = std::make_shared<const ReleasedTubes>();
};

}  // namespace palpate
