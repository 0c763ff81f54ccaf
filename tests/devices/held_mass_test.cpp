#include "integration/devices/held_mass.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate::devices {
namespace {

/// Sums of twenty terms around 1: rounding is far below this.
constexpr double kRounding = 1e-12;

TEST(HeldMass, MovesUnderAnEvenForceAsAFreeMassDoes) {
  HeldMass body({.mass_kg = 0.2, .damping_n_s_per_m = 0.0}, {1, 2, 3});
  const glm::dvec3 force(0.4, -0.2, 0.0);
  for (int n = 0; n < 100; ++n) body.advance(1e-3, force, {}, {});
  EXPECT_NEAR(body.position_m().x, 1.0 + 0.5 * 2.0 * 0.01, kRounding);
  EXPECT_NEAR(body.velocity_m_per_s().y, -1.0 * 0.1, kRounding);
}

TEST(HeldMass, FallsToItsTerminalSpeedWithViscousFriction) {
  HeldMass body({.mass_kg = 0.1, .damping_n_s_per_m = 2.0}, {});
  const double tau = 0.1 / 2.0, end = 0.5;  // v = 1.5 for the force 3
  for (int n = 0; n < 10; ++n) body.advance(0.05, {3, 0, 0}, {}, {});
  const double v = 1.5 * (1.0 - std::exp(-end / tau));
  EXPECT_NEAR(body.velocity_m_per_s().x, v, kRounding);
  EXPECT_NEAR(body.position_m().x, 1.5 * end - tau * v, kRounding);
}

TEST(HeldMass, SwingsInAHandAsADampedOscillator) {
  const HandImpedance hand{.mass_kg = 0.4, .damping_n_s_per_m = 1.0, .stiffness_n_per_m = 200.0};
  HeldMass body({.mass_kg = 0.1, .damping_n_s_per_m = 1.0, .hand = hand}, {0.01, 0, 0});
  const double decay = 2.0, omega = std::sqrt(400.0 - 4.0), t = 0.3;
  for (int n = 0; n < 300; ++n) body.advance(1e-3, {}, {}, {});
  const double expected =
      0.01 * std::exp(-decay * t) * (std::cos(omega * t) + decay / omega * std::sin(omega * t));
  EXPECT_NEAR(body.position_m().x, expected, kRounding);
}

TEST(HeldMass, FollowsAnEvenlyMovingHandExactly) {
  // If it moves with the hand, only the device's own friction acts.
  const HandImpedance hand{.mass_kg = 0.4, .damping_n_s_per_m = 5.0, .stiffness_n_per_m = 500.0};
  HeldMass body({.mass_kg = 0.1, .damping_n_s_per_m = 0.0, .hand = hand}, {});
  body.put({}, {0.2, 0, 0});
  for (int n = 0; n < 200; ++n)
    body.advance(1e-3, {}, {0.2e-3 * n, 0, 0}, {0.2e-3 * (n + 1), 0, 0});
  EXPECT_NEAR(body.position_m().x, 0.04, kRounding);
  EXPECT_NEAR(body.velocity_m_per_s().x, 0.2, kRounding);
}

TEST(HeldMass, SlidesAsFarAsDryFrictionLetsItAndSticks) {
  const double m = 0.2, c = 0.5, v = 0.3;
  // The stop must be the same for any step: it is computed, not stepped over.
  for (const double dt : {1e-4, 1e-3, 0.013}) {
    HeldMass body({.mass_kg = m, .damping_n_s_per_m = 0.0, .coulomb_n = c}, {});
    body.put({}, {v, 0, 0});
    for (double t = 0.0; t < 0.5; t += dt) body.advance(dt, {}, {}, {});
    EXPECT_NEAR(body.position_m().x, m * v * v / (2.0 * c), kRounding) << dt;
    EXPECT_EQ(body.velocity_m_per_s(), glm::dvec3(0.0)) << dt;
  }
}

TEST(HeldMass, SticksUntilTheForceBeatsDryFriction) {
  HeldMass body({.mass_kg = 0.2, .damping_n_s_per_m = 0.0, .coulomb_n = 0.5}, {});
  for (int n = 0; n < 100; ++n) body.advance(1e-3, {0.3, 0.39, 0}, {}, {});
  EXPECT_EQ(body.position_m(), glm::dvec3(0.0));
  for (int n = 0; n < 100; ++n) body.advance(1e-3, {0.6, 0.8, 0}, {}, {});
  // 1 N against 0.5 N on 0.2 kg for 0.1 s.
  EXPECT_NEAR(glm::length(body.position_m()), 0.5 * 2.5 * 0.01, kRounding);
  EXPECT_NEAR(body.position_m().y / body.position_m().x, 4.0 / 3.0, 1e-9);
}

TEST(HeldMass, TurnsBackUnderAForceAgainstDryFriction) {
  // Thrown against a constant force: slows down with F+c, comes back with F-c.
  const double m = 0.1, c = 0.2, f = 0.5, v = 0.4;
  HeldMass body({.mass_kg = m, .damping_n_s_per_m = 0.0, .coulomb_n = c}, {});
  body.put({}, {v, 0, 0});
  const double turn_s = v * m / (f + c), high = 0.5 * v * turn_s, end_s = 0.2;
  for (int n = 0; n < 200; ++n) body.advance(1e-3, {-f, 0, 0}, {}, {});
  const double back_s = end_s - turn_s;
  EXPECT_NEAR(body.position_m().x, high - 0.5 * (f - c) / m * back_s * back_s, kRounding);
  EXPECT_NEAR(body.velocity_m_per_s().x, -(f - c) / m * back_s, kRounding);
}

TEST(HeldMass, ConvergesAsTheStepIsHalvedOnABentPathWithDryFriction) {
  const auto end_of = [](int steps) {
    const HandImpedance hand{.mass_kg = 0.5, .damping_n_s_per_m = 3.0, .stiffness_n_per_m = 300.0};
    HeldMass body({.mass_kg = 0.1, .damping_n_s_per_m = 1.0, .coulomb_n = 0.3, .hand = hand},
                  {0.01, 0, 0});
    body.put({0.01, 0, 0}, {0.0, 0.3, 0.1});
    const double dt = 0.2 / steps;
    const auto intended = [&](double t) {
      return glm::dvec3(0.01 * std::cos(9.0 * t), 0.01 * std::sin(9.0 * t), 0.0);
    };
    for (int n = 0; n < steps; ++n)
      body.advance(dt, {0, 0, 0.2}, intended(n * dt), intended((n + 1) * dt));
    return body.position_m();
  };
  const glm::dvec3 exact = end_of(64000);
  const double coarse = glm::distance(end_of(1000), exact);
  const double fine = glm::distance(end_of(2000), exact);
  const double finer = glm::distance(end_of(4000), exact);
  // First order where the path bends: half the step gives half the error, within a third.
  EXPECT_LT(fine, 0.67 * coarse);
  EXPECT_LT(finer, 0.67 * fine);
  // The usual step, 50 us, is right to a hundredth of an encoder count.
  EXPECT_LT(finer, 0.4e-6);
}

TEST(HeldMass, KeepsItsVelocityWhenTheHandLetsGo) {
  HeldMass body({.mass_kg = 0.1, .damping_n_s_per_m = 0.0, .hand = kHumanHand}, {});
  body.put({}, {0.1, 0, 0});
  body.set_hand(kNoHand);
  body.advance(0.1, {}, {1, 1, 1}, {2, 2, 2});
  EXPECT_NEAR(body.position_m().x, 0.01, kRounding);
  EXPECT_EQ(body.position_m().y, 0.0);
}

}  // namespace
}  // namespace palpate::devices
