// Oracles: closed forms of the first-order heat, of the budget, and of the slew of a young contact.
#include "module/haptics/guards.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate {
namespace {

TEST(MotorHeat, FollowsTheFirstOrderStep) {
  MotorHeat heat(2.0, 8.0, 60.0);
  for (int i = 1; i <= 30000; ++i) {
    heat.step(1.0, 1e-3);
    // Implicit Euler at 1 ms against 60 s is right to dt / (2 tau) = 1e-5 of the whole.
    if (i % 5000 == 0) {
      EXPECT_NEAR(heat.heat(), 0.25 * (1.0 - std::exp(-1e-3 * i / 60.0)), 1e-5);
    }
  }
}

TEST(MotorHeat, GivesTheMostWhileCoolAndTheContinuousForceInTheEnd) {
  MotorHeat heat(2.0, 8.0, 60.0);
  EXPECT_EQ(heat.limit_n(), 8.0);
  double last = 8.0;
  for (int i = 0; i < 600'000; ++i) {
    heat.step(heat.limit_n(), 1e-3);
    ASSERT_LE(heat.heat(), 1.0 + 1e-12) << i;
    // Fastest at the start of the fade: (16 - 0.8) / 60 s * (8 - 2) N / 0.2 = 7.6 N/s.
    ASSERT_NEAR(heat.limit_n(), last, 8e-3) << i;
    ASSERT_LE(heat.limit_n(), last + 1e-12) << i;
    last = heat.limit_n();
  }
  EXPECT_NEAR(heat.limit_n(), 2.0, 1e-3);
}

TEST(MotorHeat, HoldsTheContinuousForceForEver) {
  MotorHeat heat(2.0, 8.0, 60.0);
  for (int i = 0; i < 100'000; ++i) heat.step(2.0, 0.1);
  EXPECT_GE(heat.limit_n(), 2.0);
  EXPECT_NEAR(heat.heat(), 1.0, 1e-9);
  for (int i = 0; i < 10'000; ++i) heat.step(0.0, 0.1);
  EXPECT_EQ(heat.limit_n(), 8.0);
}

TEST(PowerGate, HoldsTheHandsPowerToItsLimit) {
  PowerGate gate(2.0, 0.5, 50.0);
  double given = 0.0;
  for (int i = 0; i < 20000; ++i) {
    const double work = gate.gain() * 6.0 * 1e-3;  // the scene would give 6 W
    given += work;
    gate.step(work, 1e-3);
    ASSERT_LE(given, 0.5 + 2.0 * 1e-3 * (i + 1) + 1e-9) << i;
  }
  EXPECT_NEAR(gate.gain(), 2.0 / 6.0, 1e-6);  // settles where 6 W * gain = 2 W
}

TEST(PowerGate, IsNotFeltByAHandThatGivesBackWhatItGot) {
  PowerGate gate(2.0, 0.5, 50.0);
  for (int i = 0; i < 10000; ++i) {
    gate.step(0.01 * std::sin(0.05 * i), 1e-3);  // 10 W to and fro, 0.4 J in each half wave
    ASSERT_GE(gate.left_j(), 0.05);
  }
  PowerGate small(2.0, 0.5, 50.0);
  for (int i = 0; i < 10000; ++i) {
    small.step(0.004 * std::sin(0.05 * i), 1e-3);  // 0.16 J
    ASSERT_EQ(small.gain(), 1.0) << i;
  }
}

TEST(PowerGate, ChangesItsGainNoFasterThanItMay) {
  PowerGate gate(2.0, 0.5, 50.0);
  double last = gate.gain();
  for (int i = 0; i < 1000; ++i) {
    gate.step(i < 100 ? 1e6 : -1e6, 1e-3);
    ASSERT_LE(std::abs(gate.gain() - last), 50.0 * 1e-3 + 1e-15);
    last = gate.gain();
    if (i == 99) {
      EXPECT_EQ(gate.gain(), 0.0);
    }
  }
  EXPECT_EQ(gate.gain(), 1.0);
}

TEST(FirstContact, IsSlowWhileYoungAndThenOpensWithoutAStep) {
  FirstContact contact(200.0, 0.010);
  contact.step(false, 1e-3);
  EXPECT_EQ(contact.slew_n_per_s(2000.0), 2000.0);
  for (int ms = 0; ms < 40; ++ms) {
    contact.step(true, 1e-3);
    const double grown = ms <= 10 ? 0.0 : ms >= 20 ? 1.0 : (ms - 10) / 10.0;
    EXPECT_NEAR(contact.slew_n_per_s(2000.0), 200.0 + 1800.0 * grown, 1e-6) << ms;
  }
  EXPECT_EQ(contact.slew_n_per_s(100.0), 100.0);  // never faster than the rest may be
}

TEST(FirstContact, DoesNotStayYoungWhereTheProxyChatters) {
  FirstContact contact(200.0, 0.010);
  for (int ms = 0; ms < 40; ++ms) contact.step(ms % 3 == 0, 1e-3);
  EXPECT_EQ(contact.slew_n_per_s(2000.0), 2000.0);
  for (int ms = 0; ms < 25; ++ms) contact.step(false, 1e-3);
  contact.step(true, 1e-3);
  EXPECT_EQ(contact.slew_n_per_s(2000.0), 200.0);
}

}  // namespace
}  // namespace palpate
