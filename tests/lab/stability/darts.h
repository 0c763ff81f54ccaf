#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>

#include "module/scene/moving_volume.h"
#include "module/scene/scene_spec.h"
#include "tests/lab/stability/draws.h"

/// A hand that darts about a wall one voxel thin: does it get through without being stronger than
/// it?
namespace palpate::stability {

/// How strong the thin shell's wall is.
inline constexpr double kDartStrength_n = 20.0;

/// The thin shell as a scene: a surface that grows over the wall's outer edge.
SceneSpec dart_spec(double friction);

struct DartHand {
  double slowest_m_per_s = 1.0, fastest_m_per_s = 1.0;  ///< each way has a speed between them
  bool palpate = true;                                  ///< else the paper's loop
};

/// Frames, and in how many of them what was the case.
struct Darts {
  int64_t frames = 0, contact = 0;
  int64_t strong = 0;       ///< the force came to the wall's strength
  int64_t through = 0;      ///< the proxy was behind the wall by half a voxel, below the strength
  int64_t unseen = 0;       ///< that, and it was not flagged
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

/// So many milliseconds of straight ways between seeded points, up to 15 mm inside of the wall. A
/// frame in which the force comes to the strength, or the proxy is behind the wall, starts the hand
/// anew outside. data: a thin_shell().
Darts darted(const SceneSpec& spec, const std::shared_ptr<const MovingVolume>& data,
             const DartHand& hand, int ticks, Draws draws);

}  // namespace palpate::stability
