#include "tests/lab/stability/spring_wall.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "module/haptics/proxy/delay_lead.h"
#include "tests/support/random.h"

namespace palpate::stability {
namespace {

constexpr double kWallPeriod_s = 1e-3;
constexpr double kLost_m = 1.0;
/// Counts as rest with an exact encoder.
constexpr double kExact_m = 1e-6;
constexpr std::array<devices::HandImpedance, 4> kWallHands = {
    devices::kNoHand, devices::kLooseHand, devices::kHumanHand, devices::kFirmHand};

/// Slowest decay, 1/s, and frequency, rad/s, of the loop without rounding: M s^2 + d s + k with the
/// part of the damping that sampling and delay leave.
struct Decay {
  double rate, omega;
};

Decay decay_of(const StabilityCase& at, double lead_share) {
  const auto& [mass, damping, coulomb, hand] = at.body;
  const double m = mass + hand.mass_kg, k = at.stiffness_n_per_m + hand.stiffness_n_per_m;
  const double omega = std::sqrt(k / m);
  const double late_s = (1.0 - lead_share) * (0.5 * kWallPeriod_s + at.delay_s);
  const double lost = at.stiffness_n_per_m * std::sin(std::min(omega * late_s, 1.5)) / omega;
  const double half = 0.5 * (damping + hand.damping_n_s_per_m - lost) / m;
  const double under = half * half - omega * omega;
  // The slower of two real roots, in a form without cancellation.
  if (under > 0.0 && half > 0.0) return {omega * omega / (half + std::sqrt(under)), omega};
  return {std::max(1e-5, half), omega};
}

/// Minimum, maximum and mean square of its values.
struct Spread {
  double low = std::numeric_limits<double>::infinity(), high = -low, sum = 0.0, squares = 0.0;
  long count = 0;
  void add(double x) {
    low = std::min(low, x);
    high = std::max(high, x);
    sum += x;
    squares += x * x;
    ++count;
  }
  double rms() const {
    return std::sqrt(std::max(0.0, squares / double(count) - sum * sum / double(count * count)));
  }
};

}  // namespace

const char* hand_name(int hand) {
  constexpr std::array<const char*, 5> kNames = {"none", "loose", "human", "firm", "spring"};
  return kNames.at(size_t(hand));
}

StabilityCase stability_case(uint32_t seed, double c) {
  test::Random random(seed * 2654435761u + 12345u);
  StabilityCase at;
  at.body.mass_kg = random.log_draw(0.05, 1.0);
  at.body.damping_n_s_per_m = random.log_draw(0.1, 10.0);
  at.delay_s = random.draw(0.0, 3e-3);
  if (random.draw(0.0, 1.0) < 0.3)
    at.delay_s = kWallPeriod_s * std::round(at.delay_s / kWallPeriod_s);
  at.resolution_m = random.draw(0.0, 60e-6);
  if (random.draw(0.0, 1.0) < 0.1) at.resolution_m = 0.0;
  at.offset_m = random.draw(0.0, 1.0) * at.resolution_m;
  at.hand = std::min(4, int(random.draw(0.0, 5.0)));
  const double spring = random.log_draw(20.0, 2000.0);
  at.body.hand = at.hand < 4 ? kWallHands[size_t(at.hand)]
                             : devices::HandImpedance{.stiffness_n_per_m = spring};
  at.press_n = random.log_draw(0.1, 3.0);
  at.impact_m_per_s = random.log_draw(0.01, 0.3);
  at.stiffness_n_per_m = c * stable_stiffness(at.body.damping_n_s_per_m, kWallPeriod_s, at.delay_s);
  return at;
}

StabilityResult run_stability(const StabilityCase& at, const WallLoop& loop) {
  // Into the wall is +x. The hand's target is where it presses with the given force; without a hand
  // a weight presses.
  const double hand_k = at.body.hand.stiffness_n_per_m, wall_k = at.stiffness_n_per_m;
  const double depth_m = at.press_n / wall_k;
  const bool held = hand_k > 0.0;
  const glm::dvec3 intended(held ? depth_m + at.press_n / hand_k : 0.0, 0.0, 0.0);
  const double weight_n = held ? 0.0 : at.press_n;

  const Decay decay = decay_of(at, loop.lead_share);
  // At the first contact it is a whole depth away from its place at rest, and moves.
  const double start_m = at.impact_m_per_s / decay.omega + depth_m + 10 * kExact_m;
  const double foldings = 1.5 + std::log(start_m / (0.25 * at.resolution_m + 0.1 * kExact_m));
  const double watched_s = std::clamp(3.0 * 2.0 * std::numbers::pi / decay.omega, 0.5, 20.0);
  StabilityResult result;
  result.simulated_s =
      std::clamp(1.3 * foldings / decay.rate, 1.0, at.longest_s) + at.settling_s + watched_s;
  const long ticks = long(result.simulated_s / kWallPeriod_s);
  const long watched = long(watched_s / kWallPeriod_s);

  const int whole = int(std::floor(at.delay_s / kWallPeriod_s + 1e-9));
  const double rest_s = std::max(0.0, at.delay_s - whole * kWallPeriod_s);
  const bool fractional = rest_s > 1e-9;
  std::array<double, 8> sent{};
  devices::HeldMass body(at.body, {});
  body.put({}, {at.impact_m_per_s, 0.0, 0.0});
  DelayLead lead(kWallPeriod_s, at.delay_s, loop.lead_share);
  test::Random random(1);
  double now_s = 0.0, period_s = kWallPeriod_s;
  Spread position, force;
  for (long tick = 0; tick < ticks; ++tick) {
    double x = body.position_m().x;
    if (at.resolution_m > 0.0)
      x = std::round((x + at.offset_m) / at.resolution_m) * at.resolution_m - at.offset_m;
    const double push_n =
        loop.push_n ? loop.push_n(x, period_s)
                    : -wall_k * std::max(0.0, lead.add(std::llround(now_s * 1e9), {x, 0.0, 0.0}).x);
    if (at.jitter_s > 0.0)
      period_s = std::max(1e-5, kWallPeriod_s + random.draw(-at.jitter_s, at.jitter_s));
    now_s += period_s;
    sent[size_t(tick) % sent.size()] = push_n;
    const double now_n = sent[size_t(tick - whole) % sent.size()];
    const double before_n = sent[size_t(tick - whole - 1) % sent.size()];
    const double first_s = fractional ? std::min(rest_s, period_s) : 0.0;
    if (first_s > 0.0) body.advance(first_s, {before_n + weight_n, 0.0, 0.0}, intended, intended);
    if (period_s > first_s)
      body.advance(period_s - first_s, {now_n + weight_n, 0.0, 0.0}, intended, intended);
    result.largest_n = std::max(result.largest_n, -push_n);
    // It will not come back.
    if (std::abs(body.position_m().x) > kLost_m) {
      result.swing_m = kLost_m;
      result.limit_cycle = true;
      return result;
    }
    if (tick < ticks - watched) continue;
    if (tick == ticks - watched && loop.watch) loop.watch();
    position.add(body.position_m().x);
    force.add(push_n);
  }
  result.swing_m = position.high - position.low;
  result.force_rms_n = force.rms();
  result.limit_cycle = !(result.swing_m <= 2.0 * at.resolution_m + kExact_m);
  return result;
}

}  // namespace palpate::stability
