#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>

#include "module/scene/moving_volume.h"
#include "module/scene/scene_spec.h"
#include "tests/support/random.h"

/// A fast hand at a wall one voxel thin: does it pass through with a force below the wall's
/// strength?
namespace palpate::stability {

/// The strength of the thin shell's wall.
inline constexpr double kDartStrength_n = 20.0;

/// The thin shell as a scene: a surface whose strength grows over the wall's outer edge.
SceneSpec dart_spec(double friction);

struct DartHand {
  /// Each stroke has a speed between them.
  double slowest_m_per_s = 1.0, fastest_m_per_s = 1.0;
  bool palpate = true;  ///< else the paper's loop
};

/// The number of frames, and of frames with each condition.
struct Darts {
  int64_t frames = 0, contact = 0;
  /// The force reached the wall's strength.
  int64_t strong = 0;
  /// The proxy was behind the wall by half a voxel, below the strength.
  int64_t through = 0;
  /// The same, without a flag.
  int64_t unseen = 0;
  double deepest_m = -1.0;  ///< of the proxy behind the wall's middle, below the strength
  void operator+=(const Darts& o) {
    frames += o.frames;
    contact += o.contact;
    strong += o.strong;
    through += o.through;
    unseen += o.unseen;
    deepest_m = std::max(deepest_m, o.deepest_m);
  }
};

/// This many milliseconds of straight strokes between seeded points, up to 15 mm inside of the
/// wall. After a frame in which the force reaches the strength, or the proxy is behind the wall,
/// the hand starts again outside. data: a thin_shell().
Darts darted(const SceneSpec& spec, const std::shared_ptr<const MovingVolume>& data,
             const DartHand& hand, int ticks, test::Random random);

}  // namespace palpate::stability
