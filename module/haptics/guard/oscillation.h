#pragma once

#include <glm/glm.hpp>

namespace palpate {

/// Detects a force that oscillates at 20 to 300 Hz, as it does when the spring is too stiff for the
/// loop, and lowers it. Both must hold:
/// - power: the mean square of the band-passed force, over 50 ms;
/// - a row of half waves along the buzz's own axis, each of either sign, of like size and shorter
///   than that of 15 Hz. A touch, however hard, makes one or two half waves of which the second is
///   far smaller; tapping and a beating wall (up to 10 Hz) make long or unlike ones.
/// While it buzzes the gain falls, and comes back over seconds once it has stopped; if the buzz
/// goes on at the lowest gain it trips. Thresholds differ for beginning and ending (hysteresis).
/// It also tells who shakes. In a loop that is not stable the hand and the spring shake each other,
/// and the spring's force is the hand's own motion times the stiffness; where a scene shakes, the
/// hand moves less than that. A value; no clock; real-time safe.
class OscillationGuard {
 public:
  /// buzz_n: root mean square of the force in the band from which on it is a buzz, > 0.
  explicit OscillationGuard(double buzz_n) noexcept;
  /// force_n, finite, was on the hand for dt_s > 0; hand_n, finite: where the hand is, times the
  /// stiffness of its spring, N.
  void step(glm::dvec3 force_n, glm::dvec3 hand_n, double dt_s) noexcept;
  /// Factor on the scene's force, 1 when quiet; changes by at most 7 per second.
  double gain() const noexcept { return gain_; }
  bool buzzing() const noexcept { return buzzing_; }
  bool tripped() const noexcept { return tripped_; }
  /// The scene shakes the hand, and not the loop, in this buzz or in the last one.
  bool is_scenes() const noexcept { return is_scenes_; }
  double rms_n() const noexcept;
  void reset() noexcept { *this = OscillationGuard(buzz_n_); }

 private:
  /// Two high passes and a low pass of first order.
  struct Band {
    glm::dvec3 last{0.0}, high1{0.0}, high2{0.0}, band{0.0};
    void step(glm::dvec3 value, double dt_s) noexcept;
  };
  void hear(double along_axis, double dt_s) noexcept;
  void ramp_gain(double dt_s) noexcept;

  double buzz_n_;
  Band force_, hand_;
  glm::dvec3 axis_{0.0};
  double power_ = 0.0, hand_power_ = 0.0;
  double wave_sign_ = 1.0, wave_peak_ = 0.0, wave_s_ = 0.0;
  double last_peak_ = 0.0, last_but_one_peak_ = 0.0;
  int row_ = 0;
  double gain_ = 1.0, ceiling_ = 1.0, lowest_s_ = 0.0;
  bool buzzing_ = false, tripped_ = false, heard_ = false, is_scenes_ = false;
};

}  // namespace palpate
