#pragma once

#include <memory>
#include <string>
#include <vector>

#include "module/haptics/hand_commands.h"
#include "module/session/stream_tube.h"

namespace palpate {

/// A stream tube that a hand has released.
struct ReleasedTube {
  size_t volume = 0;  ///< of the scene
  bool kept = false;
  std::shared_ptr<const StreamTube> tube;
};
using ReleasedTubes = std::vector<ReleasedTube>;

/// The stream tubes of a hand: released, kept and cleared by its commands, and taken along when the
/// scene gets other data. One thread; what tubes() gives goes to any.
class HandTubes {
 public:
  static constexpr size_t kMost = 64;  ///< beyond it the oldest that is not kept goes

  /// Does what was asked. A tube follows tube_field() of the first volume with one around the hand.
  /// A sentence for the person where that can not be; else empty.
  std::string take(const HandCommand& command, const Scene& scene);
  /// Takes the tubes over to the scene's data, which agree with those before at `now`. Those that
  /// can not be taken are gone, and that is said.
  std::string follow(const Scene& scene, const SceneSnapshot& now);

  /// Never null.
  std::shared_ptr<const ReleasedTubes> tubes() const { return tubes_; }

 private:
  std::string release(const Scene& scene, const SceneSnapshot& snapshot);
  void clear();

  std::shared_ptr<const ReleasedTubes> tubes_ = std::make_shared<const ReleasedTubes>();
};

}  // namespace palpate
