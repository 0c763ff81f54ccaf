#pragma once

#include <memory>

#include "module/haptics/proxy/haptics.h"

namespace palpate::stability {

/// A human hand that leans 10 mm into a ball that moves by itself: its place swings, or its data
/// beat.
struct LeaningCase {
  double amplitude_m = 0.0, swing_hz = 0.0;  ///< of the ball's place, along the hand's way
  double beats_hz = 0.0;                     ///< of the data, 10 mm in radius; 0: they stand still
  double stiffness_n_per_m = 1000.0;
  double seconds = 10.0;
};

struct LeaningResult {
  /// The largest excess, at any time, of the work on the hand over what the tank's header
  /// guarantees (capacity, allowance, sampling energy, and the spring's energy at the start, which
  /// is zero), J.
  double beyond_j = -1.0;
  /// The energy that the scene needed and the tank did not give.
  double refused_j = 0.0;
};

/// metered: with the energy tank. Without guards: the scene's own force. Takes some microseconds
/// per simulated millisecond.
LeaningResult lean(const LeaningCase& at, bool metered);

/// The same for given data (a shell() at the origin).
LeaningResult lean(const LeaningCase& at, bool metered,
                   const std::shared_ptr<const MovingVolume>& data);

/// The damping of hand and device together, N s/m, which dissipates the energy of a wall's motion.
double leaning_damping_n_s_per_m();

}  // namespace palpate::stability
