#pragma once

#include <array>
#include <glm/glm.hpp>

namespace palpate::devices {

/// A hand on the grip, as seen from the grip: M a + B (v - v') + K (x - x') with x' where the hand
/// means to be. No hand: all zero.
struct HandImpedance {
  double mass_kg = 0.0;
  double damping_n_s_per_m = 0.0;
  double stiffness_n_per_m = 0.0;
};

inline constexpr HandImpedance kNoHand{};
/// One measured hand: Sci. Rep. srep18004, figure 3.
inline constexpr HandImpedance kHumanHand{
    .mass_kg = 0.554, .damping_n_s_per_m = 6.45, .stiffness_n_per_m = 135.0};
/// Chosen, not measured: fingertips that barely hold, and a fist.
inline constexpr HandImpedance kLooseHand{
    .mass_kg = 0.1, .damping_n_s_per_m = 1.0, .stiffness_n_per_m = 30.0};
inline constexpr HandImpedance kFirmHand{
    .mass_kg = 1.0, .damping_n_s_per_m = 25.0, .stiffness_n_per_m = 1000.0};

/// What moves: the device's grip with the hand that holds it.
struct MassProperties {
  double mass_kg = 0.1;  ///< of the device alone, > 0
  double damping_n_s_per_m = 1.0;
  double coulomb_n = 0.0;  ///< dry friction, the same in every direction
  HandImpedance hand;
};

/// A point mass with viscous and dry friction, pulled by a motor and by a hand. Between two calls
/// the motor's force is constant and the hand's intended position moves evenly; then
///   (m+M) a + (b+B) v + K (x - x'(t)) = F + B v' - c v/|v|
/// is solved exactly (by its power series, no quadrature) as long as the direction of the friction
/// stays. That is always in one dimension, where stops and starts are found as events, and to first
/// order in the length of the step where the path bends. A value; no clock, no allocation.
class HeldMass {
 public:
  HeldMass(const MassProperties& properties, glm::dvec3 position_m);

  /// Moves on by dt_s under motor_n while the hand's intended position goes from intended_from_m to
  /// intended_to_m. Any dt_s > 0; long steps are cut so that the series converges.
  void advance(double dt_s, glm::dvec3 motor_n, glm::dvec3 intended_from_m,
               glm::dvec3 intended_to_m) noexcept;

  /// Exchanges the hand (or none); position and velocity stay.
  void set_hand(const HandImpedance& hand) noexcept;
  /// Stops at this place: an end of the workspace.
  void put(glm::dvec3 position_m, glm::dvec3 velocity_m_per_s) noexcept;

  glm::dvec3 position_m() const { return position_m_; }
  glm::dvec3 velocity_m_per_s() const { return velocity_m_per_s_; }
  const MassProperties& properties() const { return properties_; }

 private:
  /// s'' + c s' + k s = 0, s(0) = 0, s'(0) = 1: s, its derivative and its first two integrals.
  struct Response {
    double rate, value, integral, integral2;
  };
  struct MassState {
    glm::dvec3 offset, velocity;
  };
  Response response(double t_s) const noexcept;
  const Response& kept_response(double t_s) noexcept;
  MassState after(const Response& r, const MassState& from, glm::dvec3 push,
                  glm::dvec3 push_rate) const;
  void slide(double dt_s, glm::dvec3 motor_n, glm::dvec3 intended_m,
             glm::dvec3 intended_rate) noexcept;
  double stop_time(double dt_s, const MassState& from, glm::dvec3 push, glm::dvec3 push_rate,
                   glm::dvec3 direction) const noexcept;
  void refresh() noexcept;

  MassProperties properties_;
  glm::dvec3 position_m_;
  glm::dvec3 velocity_m_per_s_{0.0};
  double mass_kg_ = 1.0;                         ///< of both
  double damping_ = 0.0;                         ///< c = (b+B)/(m+M), 1/s
  double stiffness_ = 0.0;                       ///< k = K/(m+M), 1/s^2
  double longest_s_ = 1e-3;                      ///< step for which the series converges fast
  std::array<double, 2> kept_dt_s_{-1.0, -1.0};  ///< the two usual steps: their responses are kept
  std::array<Response, 2> kept_{};
  int oldest_ = 0;
};

}  // namespace palpate::devices
