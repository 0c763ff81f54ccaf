#pragma once

#include <memory>

#include "module/haptics/haptics.h"

namespace palpate::stability {

/// A human hand that leans 10 mm into a ball that moves by itself: its place swings, its data beat.
struct LeaningCase {
  double amplitude_m = 0.0, swing_hz = 0.0;  ///< of the ball's place, along the hand's way
  double beats_hz = 0.0;                     ///< of the data, 10 mm in radius; 0: they stand still
  double stiffness_n_per_m = 1000.0;
  double seconds = 10.0;
};

struct LeaningResult {
  /// The most that the work on the hand was, at any time, beyond what the tank's header promises
  /// (capacity, allowance, what sampling made, what the spring held at the start: nothing), J.
  double beyond_j = -1.0;
  double refused_j = 0.0;  ///< what the scene asked for and the tank did not give
};

/// metered: with the energy tank. Without guards: the scene's own force. Its cost is some
/// microseconds a simulated millisecond.
LeaningResult lean(const LeaningCase& at, bool metered);

/// The same for data of the caller's (a shell() at the origin).
LeaningResult lean(const LeaningCase& at, bool metered,
                   const std::shared_ptr<const MovingVolume>& data);

/// The damping of hand and device together, N s/m: what turns a wall's motion into heat.
double leaning_damping_n_s_per_m();

}  // namespace palpate::stability
