#pragma once

#include <cstdint>
#include <functional>

#include "integration/devices/held_mass.h"

namespace palpate::stability {

/// A device, a hand and a spring wall, sampled at 1 kHz with a zero-order hold. One dimension: the
/// wall's normal.
struct StabilityCase {
  devices::MassProperties body;
  /// From the reading of a position to the force, whole or fractional samples.
  double delay_s = 0.0;
  double resolution_m = 0.0;  ///< of the encoder
  /// Of the wall relative to the encoder's counts.
  double offset_m = 0.0;
  /// The force at rest of the hand or, without one, of a weight.
  double press_n = 1.0;
  double impact_m_per_s = 0.1;     ///< speed at the first touch
  double stiffness_n_per_m = 0.0;  ///< of the wall
  int hand = 0;                    ///< place in hand_name()
  /// Every period is longer or shorter by up to this, uniformly distributed.
  double jitter_s = 0.0;
  double longest_s = 2000.0;  ///< of simulated time
  /// More time for other things that must come to rest: guards.
  double settling_s = 0.0;
};

/// The loop between encoder and motor.
struct WallLoop {
  /// The compensated share of the loss by sampling and delay: see DelayLead; 0 is the plain loop.
  double lead_share = 0.0;
  /// Replaces lead and spring: the force (N) for a position (m) and the time since the last one
  /// (s).
  std::function<double(double x_m, double dt_s)> push_n;
  /// Called at the begin of the watched part; may be empty.
  std::function<void()> watch;
};

/// "none", "loose", "human", "firm", "spring" (a spring without mass or damping: the worst passive
/// hand).
const char* hand_name(int hand);

/// A random case of the grid: uniform (delay 0 to 3 ms, 30 % of them whole samples; encoder 0 to 60
/// um, 10 % of them exact; hand) or uniform in the logarithm (mass 0.05 to 1 kg, damping 0.1 to 10
/// N s/m, press 0.1 to 3 N, impact 0.01 to 0.3 m/s). Stiffness: c b / (T/2 + delay).
StabilityCase stability_case(uint32_t seed, double c);

struct StabilityResult {
  double swing_m = 0.0;      ///< peak to peak, of the true position in the last part of the run
  double force_rms_n = 0.0;  ///< of the commanded force about its mean, in the same part
  double largest_n = 0.0;    ///< force in the whole run
  double simulated_s = 0.0;
  bool limit_cycle = false;
  bool heard = false;  ///< a guard lowered the force: see run_guarded()
};

/// The criterion of a limit cycle: a swing of more than two counts (1 um for an exact encoder,
/// added). It counts after the time in which the loop without rounding decays from the impact to a
/// quarter of a count, and 1.5 e-foldings and 30 % more. Why two: for a motion with an amplitude
/// below one count the encoder is a relay, whose gain for small motions is unbounded. So without
/// dry friction any spring on any encoder oscillates there, whatever its stiffness. From an
/// amplitude of one count on the gain is at most 1.12, and a remaining oscillation is caused by the
/// loop.
StabilityResult run_stability(const StabilityCase& at, const WallLoop& loop);
inline StabilityResult run_stability(const StabilityCase& at, double lead_share) {
  return run_stability(at, WallLoop{lead_share, {}, {}});
}

}  // namespace palpate::stability
