#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

namespace palpate {

/// The largest stiffness, N/m, for which the energy that a sampled spring makes (sampled every
/// period_s with zero-order hold, late by delay_s) is no more than what the device's damping b (N
/// s/m) dissipates: K = b / (T/2 + delay); Colgate and Schenkel's condition with a delay. Infinite
/// if nothing is late. Holds for any passive hand.
double stable_stiffness(double damping_n_s_per_m, double period_s, double delay_s) noexcept;

/// A prediction of where the hand is when the force that is computed now acts: the newest position
/// plus share * (T/2 + delay) times the velocity over the last two samples.
///
/// Why: near stable_stiffness() a sampled spring has no damping left, and the encoder's rounding,
/// whose gain is up to 1.27 where the motion is a count or two, turns that into a limit cycle. The
/// lead gives back `share` of what sampling and delay cost, and costs nothing at rest: a still hand
/// gives the newest position, exactly. Two samples, because a longer line is late itself where
/// light devices swing fast, and a single difference doubles the encoder's step in the force.
/// Space: any, m. A value: no clock, no allocation; real-time safe.
class DelayLead {
 public:
  static constexpr double kShare = 0.6;  ///< measured: palpate-lab feel stability
  /// Never predicts if period_s <= 0 or a number is not finite. delay_s: from taking a position to
  /// the force on the motors, without the zero-order hold.
  DelayLead(double period_s, double delay_s, double share = kShare) noexcept;

  /// Takes a position with the time at which it was taken; returns the predicted one. A time that
  /// is not later than the last (an exchange without a new position) gives the last result again.
  /// After a gap of more than eight periods, a time set back, or a position that is not finite, it
  /// starts anew, without lead.
  glm::dvec3 add(int64_t time_ns, glm::dvec3 position_m) noexcept;
  void reset() noexcept { count_ = 0; }
  double lead_s() const noexcept { return lead_s_; }

 private:
  struct DelayedForce {
    int64_t time_ns = 0;
    glm::dvec3 position_m{0.0};
  };
  double lead_s_ = 0.0;
  int64_t longest_gap_ns_ = 0;
  std::array<DelayedForce, 2> past_{};  ///< newest first
  int count_ = 0;
  glm::dvec3 answer_m_{0.0};
};

}  // namespace palpate
