#pragma once

#include <memory>

#include "module/haptics/haptics.h"
#include "tests/haptics/shell_scene.h"

namespace palpate::bench {

/// What moves in a scene of hearts.
enum class Moves { kNothing, kTransform, kBoth };

/// Hearts as `palpate feel heart` has them, 8 mm apart where there are several; where transforms
/// move, they come from a second hand. Every second mode of a heart is one that guides along the
/// gradient, all others are its wall.
SceneSpec hearts_spec(int volumes, int modes_of_each, Moves moves,
                      PosePath path = PosePath::kSmooth,
                      BackTracking method = BackTracking::kNewton);

/// The heart phantom of 128^3 at 1 mm. Made once and kept: still is its first frame alone.
std::shared_ptr<const MovingVolume> heart_volume(bool still);

/// A hand on hearts: 3 mm and less inside of the outer wall for most of the time, 1 mm outside for
/// the rest, stroking at 50 mm/s. Poses come from graphics frames of 11 and 22 ms in turn.
class HeartHand {
 public:
  HeartHand(int volumes, Moves moves) : volumes_(volumes), moves_(moves) {}
  /// The next millisecond. first: where the first volume's sequence stood in the last one.
  void next(TickInput& input, FramePointer first) noexcept;
  int64_t ticks() const { return tick_; }

 private:
  int volumes_;
  Moves moves_;
  int64_t tick_ = 0, next_pose_ns_ = 0;
  bool long_frame_ = false;
};

/// The paper's haptic frame, built from the same parts: transforms by its (17) to (21) where the
/// scene says so, back-tracking by its fixed point where the scene says so, primitives at the proxy
/// of the last frame, one solve, and the proxy goes there at once. What palpate adds is not in it:
/// no sweep, no tank, no guards.
class PaperLoop {
 public:
  explicit PaperLoop(std::shared_ptr<const HapticScene> scene) : run_(std::move(scene)) {}
  /// Proxy and force; the command stays zero.
  TickOutput tick(const TickInput& input) noexcept;
  const HapticRun& run() const { return run_; }

 private:
  HapticRun run_;
  Placed placed_;
  bool started_ = false;
};

/// What a Hand is, for the paper's loop.
class PaperHand {
 public:
  PaperHand(const SceneSpec& spec, std::vector<std::shared_ptr<const MovingVolume>> data);
  TickOutput to(glm::dvec3 probe_m);
  PaperLoop loop;
  TickInput input;
};

/// Options without guards, tank and lead: the scene's own force.
HapticsOptions bare();

/// Two figures of many errors.
struct Errors {
  double worst = 0.0, squares = 0.0;
  int64_t count = 0;
  void add(double error) {
    worst = std::max(worst, error);
    squares += error * error;
    ++count;
  }
  double rms() const { return count ? std::sqrt(squares / double(count)) : 0.0; }
};

}  // namespace palpate::bench
