#pragma once

#include <vector>

#include "integration/devices/held_mass.h"
#include "tests/lab/stability/map.h"

/// Where the loop between hand and device oscillates, and where a moving scene adds energy to it.
namespace palpate::stability {

/// One point in the maps of the spring wall. A device of a Falcon's size: 0.15 kg.
struct LoopPoint {
  double stiffness_share = 1.0;  ///< of b / (T/2 + delay)
  double damping_n_s_per_m = 2.0;
  double delay_s = 1e-3;
  double resolution_m = 38e-6;
  double coulomb_n = 0.0;
  double jitter_s = 0.0;
  double longest_s = 20.0;  ///< simulated, beyond the limit
};

/// The code between encoder and motor.
enum class Loop {
  /// A spring, which can report nothing.
  kPlain,
  /// palpate at a device that does not report its limit: lead and guards.
  kGuarded,
  /// palpate at a device that reports its limit, so palpate uses no more stiffness.
  kPalpate,
};

/// For five hands (none, loose, human, firm, a bare spring) at this point: the largest swing in
/// micrometres, and the worst outcome. palpate flags a failure by a guard that lowers the force.
Cell loop_cell(const LoopPoint& at, Loop loop, uint32_t seed);
/// The same for one of the hands: its index in hand_name().
Cell loop_cell(const LoopPoint& at, int hand, Loop loop, uint32_t seed);

/// A hand that leans into a ball whose place swings (Hz, m) or whose data beat (Hz, at a stiffness
/// in N/m): the energy that it got beyond the tank's limit, J. kHeld: none, and none was refused.
Cell swing_cell(double hz, double amplitude_m, bool tank, double seconds);
Cell beat_cell(double hz, double stiffness_n_per_m, bool tank, double seconds);

/// The amplitude of a swing at a frequency above which it adds more power to hand and device than
/// the tank's allowance: b omega^2 A^2 / 2 = allowance. m.
double consented_amplitude_m(double hz);

StabilityMap stiffness_map(const Making& making);
StabilityMap damping_map(const Making& making);
StabilityMap hands_map(const Making& making);
StabilityMap jitter_map(const Making& making);
StabilityMap encoder_map(const Making& making);
StabilityMap swing_map(const Making& making);
StabilityMap beat_map(const Making& making);

}  // namespace palpate::stability
