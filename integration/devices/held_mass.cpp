#include "integration/devices/held_mass.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace palpate::devices {
namespace {

/// Terms of the power series: with c t <= 1 and k t^2 <= 1 the first one left out is below 1/20!.
constexpr int kTerms = 20;
constexpr auto kInverse = [] {
  std::array<double, kTerms + 3> inverse{};
  for (int n = 1; n < int(inverse.size()); ++n) inverse[n] = 1.0 / n;
  return inverse;
}();
/// The mass counts as stopped at this velocity; no hand creeps more slowly.
constexpr double kStopped_m_per_s = 1e-12;
/// How long a pull that changes evenly stays below dry friction: the first t > 0 with
/// |pull + rate t| = friction.
double sticking_time(glm::dvec3 pull, glm::dvec3 rate, double friction) {
  const double a = glm::dot(rate, rate), b = glm::dot(pull, rate);
  const double c = glm::dot(pull, pull) - friction * friction;
  if (!(a > 0.0)) return std::numeric_limits<double>::infinity();
  // A little later, so that it slides then.
  return (std::sqrt(std::max(0.0, b * b - a * c)) - b) / a * (1.0 + 1e-9) + 1e-15;
}

/// The most stops and starts within one step; a mass that reverses more often is at rest.
constexpr int kEvents = 16;

}  // namespace

HeldMass::HeldMass(const MassProperties& properties, glm::dvec3 position_m)
    : properties_(properties), position_m_(position_m) {
  assert(properties.mass_kg > 0.0);
  refresh();
}

void HeldMass::set_hand(const HandImpedance& hand) noexcept {
  properties_.hand = hand;
  refresh();
}

void HeldMass::put(glm::dvec3 position_m, glm::dvec3 velocity_m_per_s) noexcept {
  position_m_ = position_m;
  velocity_m_per_s_ = velocity_m_per_s;
}

void HeldMass::refresh() noexcept {
  const HandImpedance& hand = properties_.hand;
  mass_kg_ = properties_.mass_kg + hand.mass_kg;
  damping_ = (properties_.damping_n_s_per_m + hand.damping_n_s_per_m) / mass_kg_;
  stiffness_ = hand.stiffness_n_per_m / mass_kg_;
  longest_s_ = 1.0 / std::max({damping_, std::sqrt(stiffness_), 1e-3});
  kept_dt_s_ = {-1.0, -1.0};
}

const HeldMass::Response& HeldMass::kept_response(double t_s) noexcept {
  for (int n = 0; n < 2; ++n) {
    if (kept_dt_s_[n] == t_s) return kept_[n];
  }
  const int place = oldest_;
  oldest_ = 1 - oldest_;
  kept_dt_s_[place] = t_s;
  kept_[place] = response(t_s);
  return kept_[place];
}

HeldMass::Response HeldMass::response(double t_s) const noexcept {
  // s = sum s_n t^n / n! with s_1 = 1, s_2 = -c, s_(n+2) = -c s_(n+1) - k s_n.
  Response r{0.0, 0.0, 0.0, 0.0};
  double before = 0.0, now = 1.0, power = 1.0;  // power = t^(n-1) / (n-1)!
  for (int n = 1; n <= kTerms; ++n) {
    r.rate += now * power;
    power *= t_s * kInverse[n];
    r.value += now * power;
    const double integral = now * power * t_s * kInverse[n + 1];
    r.integral += integral;
    r.integral2 += integral * t_s * kInverse[n + 2];
    const double next = -damping_ * now - stiffness_ * before;
    before = now;
    now = next;
  }
  return r;
}

HeldMass::MassState HeldMass::after(const Response& r, const MassState& from, glm::dvec3 push,
                                    glm::dvec3 push_rate) const {
  // Offset y from where the hand meant to be at the start; y'' + c y' + k y = push + push_rate t.
  return {from.offset * (r.rate + damping_ * r.value) + from.velocity * r.value +
              push * r.integral + push_rate * r.integral2,
          from.velocity * r.rate - from.offset * (stiffness_ * r.value) + push * r.value +
              push_rate * r.integral};
}

void HeldMass::advance(double dt_s, glm::dvec3 motor_n, glm::dvec3 intended_from_m,
                       glm::dvec3 intended_to_m) noexcept {
  const glm::dvec3 rate = (intended_to_m - intended_from_m) / dt_s;
  const int pieces = std::max(1, int(std::ceil(dt_s / longest_s_ - 1e-9)));
  const double piece = dt_s / pieces;
  for (int n = 0; n < pieces; ++n)
    slide(piece, motor_n, intended_from_m + rate * (n * piece), rate);
}

void HeldMass::slide(double dt_s, glm::dvec3 motor_n, glm::dvec3 intended_m,
                     glm::dvec3 intended_rate) noexcept {
  const HandImpedance& hand = properties_.hand;
  const double friction = properties_.coulomb_n / mass_kg_;
  const glm::dvec3 push_rate = stiffness_ * intended_rate;
  double left = dt_s;
  for (int event = 0; event < kEvents; ++event) {
    const glm::dvec3 reached = intended_m + intended_rate * (dt_s - left);
    const MassState from{position_m_ - reached, velocity_m_per_s_};
    const glm::dvec3 push = (motor_n + hand.damping_n_s_per_m * intended_rate) / mass_kg_;
    glm::dvec3 direction{0.0};
    if (friction > 0.0) {
      const double speed = glm::length(from.velocity);
      const glm::dvec3 pull = push - stiffness_ * from.offset;
      if (speed > kStopped_m_per_s) {
        direction = from.velocity / speed;
      } else if (glm::length(pull) <= friction) {
        velocity_m_per_s_ = glm::dvec3(0.0);
        left -= std::min(left, sticking_time(pull, push_rate, friction));
        if (left <= 0.0) return;
        continue;
      } else {
        direction = glm::normalize(pull);
      }
    }
    const glm::dvec3 rubbed = push - friction * direction;
    const MassState to =
        after(left == dt_s ? kept_response(left) : response(left), from, rubbed, push_rate);
    const bool turns = friction > 0.0 && glm::dot(to.velocity, direction) < 0.0;
    if (!turns) {
      position_m_ = reached + to.offset;
      velocity_m_per_s_ = to.velocity;
      return;
    }
    const double stop = stop_time(left, from, rubbed, push_rate, direction);
    const MassState still = after(response(stop), from, rubbed, push_rate);
    position_m_ = reached + still.offset;
    velocity_m_per_s_ = still.velocity - direction * glm::dot(still.velocity, direction);
    left -= stop;
    if (left <= 0.0) return;
  }
}

double HeldMass::stop_time(double dt_s, const MassState& from, glm::dvec3 push,
                           glm::dvec3 push_rate, glm::dvec3 direction) const noexcept {
  double low = 0.0, high = dt_s;
  for (int n = 0; n < 50; ++n) {
    const double middle = 0.5 * (low + high);
    const MassState at = after(response(middle), from, push, push_rate);
    (glm::dot(at.velocity, direction) > 0.0 ? low : high) = middle;
  }
  return high;
}

}  // namespace palpate::devices
