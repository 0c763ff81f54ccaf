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

/// Limits the energy that a contact gives back. A force that was limited on the hand's way in and
/// is whole on its way out gives back more than it took, and would keep a bouncing grip bouncing.
/// So while the force falls from w_t, where s_t of it was given, no more than
///   s_t (w / w_t)^n,  n + 1 = 2 (s_t / w_t) (wanted's work / given's work), n from 1 to 8,
/// is given: for a spring that is exactly the work that the hand did. n = 1 and s_t = w_t where
/// nothing was limited. The limit is lifted over a tenth of a second in which the force does not
/// fall, gradually and not at once. Values; real-time safe.
class PassiveReturn {
 public:
  /// The hand moved: its work against the wanted force and against what was given, J.
  void move(double wanted_j, double given_j) noexcept;
  /// The most that may be given where wanted_n is wanted; infinite where nothing is limited.
  double most_n(double wanted_n) noexcept;
  /// What was given then, for dt_s.
  void give(double given_n, double dt_s) noexcept;

 private:
  double wanted_j_ = 0.0, given_j_ = 0.0;
  double wanted_n_ = 0.0, turn_wanted_n_ = 0.0, turn_given_n_ = 0.0;
  double most_n_ = std::numeric_limits<double>::infinity();  ///< that may be given now
  bool falls_ = false;
};

}  // namespace palpate
