#pragma once

#include <limits>

namespace palpate {

/// The motors' heat: dT/dt = (F^2 / F_c^2 - T) / tau, T = 1 for the temperature that the force F_c
/// gives in the end. Values; real-time safe.
class MotorHeat {
 public:
  /// continuous_n: F_c, which the motors hold for ever; most_n: which they hold for a short time;
  /// time_constant_s: tau. All > 0.
  MotorHeat(double continuous_n, double most_n, double time_constant_s) noexcept;
  /// The force was force_n for dt_s.
  void step(double force_n, double dt_s) noexcept;
  /// What may be given now, N: most_n while cool, from T = 0.8 to 1 down to F_c. Continuous in T,
  /// and T in time, so it never steps; at F_c T stays below 1 for ever.
  double limit_n() const noexcept;
  double heat() const noexcept { return heat_; }

 private:
  double continuous_n_, most_n_, time_constant_s_, heat_ = 0.0;
};

/// Limits the power that the force gives to the hand, beyond what the hand gave back: the whole
/// budget may be spent at once, power_w for ever. Values; real-time safe.
class PowerGate {
 public:
  /// gain_per_s: the fastest that gain() may change.
  PowerGate(double power_w, double budget_j, double gain_per_s) noexcept;
  /// The force did work_j on the hand (negative: the hand on the device) in dt_s.
  void step(double work_j, double dt_s) noexcept;
  /// Factor on the whole force: 1 with half the budget left, falling with it to 0 at the end. It
  /// scales the whole force, not only its part along the velocity, since the direction of that part
  /// changes erratically when the hand is nearly still.
  double gain() const noexcept { return gain_; }
  double left_j() const noexcept { return left_j_; }

 private:
  double power_w_, budget_j_, gain_per_s_;
  double left_j_, gain_ = 1.0;
};

/// Limits the rise of the force at the beginning of a contact, when a wrong stiffness, a wrong pose
/// or a proxy that was moved shows as a spike. Values; real-time safe.
class FirstContact {
 public:
  FirstContact(double young_n_per_s, double young_s) noexcept;
  /// A contact that was lost for less than 20 ms goes on: a proxy that chatters on a surface does
  /// not begin a new contact each time.
  void step(bool touching, double dt_s) noexcept;
  /// How fast the force may rise: young_n_per_s for young_s, then up to full_n_per_s over as long
  /// again, so that what was limited does not come all at once.
  double slew_n_per_s(double full_n_per_s) const noexcept;

 private:
  double young_n_per_s_, young_s_;
  double age_s_ = 0.0, apart_s_ = 1.0;
};

/// Limits the energy that a contact gives back. A force that rises slowly at a first touch takes
/// less of the hand's energy on the way in than the whole force gives on the way out, and would
/// keep a bouncing grip bouncing. So what the hand did not put in is owed,
///   d(owed) = -(wanted - given) . d(hand), from 0 to the energy that the spring can give back,
/// and while the hand withdraws only the share 1 - owed / that energy is given: the hand gets its
/// own work, and no more. A wall that moves under a resting hand owes nothing. The share never
/// jumps: it falls as the hand's own withdrawal unloads the spring and no faster, and rises at
/// rate_n_per_s, at once where the hand no longer withdraws. What is owed is forgiven from a tenth
/// of a second after the touch on: no grip bounces so slowly on what a touch holds back. Values;
/// real-time safe.
class PassiveReturn {
 public:
  explicit PassiveReturn(double rate_n_per_s) noexcept : rate_n_per_s_(rate_n_per_s) {}
  /// The hand moved: its work against the force that was wanted (within the force limit) and
  /// against the one that was given, J.
  void move(double wanted_j, double given_j) noexcept;
  /// The most that may be given now; infinite where nothing is limited. spring_n: the scene's force
  /// before the force limit, N; wanted_n: the part of it that the limit allows; stiffness_n_per_m:
  /// of the spring at the hand, 0 if there is none; dt_s: since the last frame.
  double most_n(double spring_n, double wanted_n, double stiffness_n_per_m, double dt_s) noexcept;
  /// What was given then, N.
  void give(double given_n) noexcept;

 private:
  double rate_n_per_s_;
  double owed_j_ = 0.0, age_s_ = 0.0;  ///< of the contact
  double out_j_ = 0.0;     ///< the spring's work on the hand in the last move; 0: no withdrawal
  double wanted_n_ = 0.0;  ///< of the last frame
  double share_ = 1.0;     ///< of the wanted force that may be given
  double given_ = 1.0;     ///< share that was given in the last frame
};

}  // namespace palpate
