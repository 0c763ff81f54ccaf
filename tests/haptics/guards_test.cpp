// Oracles: closed forms of the first-order heat model, of the energy budget, and of the slew limit
// of a new contact.
#include "module/haptics/guards.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace palpate {
namespace {

TEST(MotorHeat, FollowsTheFirstOrderStep) {
  MotorHeat heat(2.0, 8.0, 60.0);
  for (int i = 1; i <= 30000; ++i) {
    heat.step(1.0, 1e-3);
    // Implicit Euler at 1 ms with a time constant of 60 s is right to dt / (2 tau) = 1e-5 of the
    // whole.
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
    // At full gain the force would give 6 W.
    const double work = gate.gain() * 6.0 * 1e-3;
    given += work;
    gate.step(work, 1e-3);
    ASSERT_LE(given, 0.5 + 2.0 * 1e-3 * (i + 1) + 1e-9) << i;
  }
  EXPECT_NEAR(gate.gain(), 2.0 / 6.0, 1e-6);  // settles where 6 W * gain = 2 W
}

TEST(PowerGate, IsNotFeltByAHandThatGivesBackWhatItGot) {
  PowerGate gate(2.0, 0.5, 50.0);
  for (int i = 0; i < 10000; ++i) {
    // 10 W back and forth, 0.4 J in each half wave.
    gate.step(0.01 * std::sin(0.05 * i), 1e-3);
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
  // Never faster than the general slew limit.
  EXPECT_EQ(contact.slew_n_per_s(100.0), 100.0);
}

TEST(FirstContact, DoesNotStayYoungWhereTheProxyChatters) {
  FirstContact contact(200.0, 0.010);
  for (int ms = 0; ms < 40; ++ms) contact.step(ms % 3 == 0, 1e-3);
  EXPECT_EQ(contact.slew_n_per_s(2000.0), 2000.0);
  for (int ms = 0; ms < 25; ++ms) contact.step(false, 1e-3);
  contact.step(true, 1e-3);
  EXPECT_EQ(contact.slew_n_per_s(2000.0), 200.0);
}

/// A grip moves 4 mm into a spring of 4000 N/m and out again as a sine, 20 ms in total. The output
/// force rises by at most rise_n per millisecond. Returns the work on the grip, mJ.
double hit_mj(double rise_n, double most_n, int hold_ms) {
  PassiveReturn back;
  double x = 0.0, given = 0.0, wanted = 0.0, work_mj = 0.0;
  for (int ms = 1; ms <= 20 + hold_ms; ++ms) {
    const int phase = ms <= 10 ? ms : ms <= 10 + hold_ms ? 10 : ms - hold_ms;
    const double to = 4.0 * std::sin(0.5 * std::numbers::pi * phase / 10.0);  // mm
    work_mj -= given * (to - x);
    back.move(1e-3 * wanted * (to - x), 1e-3 * given * (to - x));
    x = to;
    wanted = std::max(0.0, 4.0 * x);
    given = std::min({wanted, most_n, given + rise_n, back.most_n(wanted)});
    back.give(given, 1e-3);
  }
  return work_mj;
}

TEST(PassiveReturn, GivesAHitNoMoreBackThanItTook) {
  // The force is constant for a millisecond, so even an unlimited spring returns more energy than
  // it takes. This error of sampling is the reference.
  const double sampled_mj = hit_mj(1e9, 1e9, 0);
  EXPECT_GT(sampled_mj, 0.0);
  for (const double most_n : {4.0, 8.0, 100.0}) {
    for (const double rise_n : {0.1, 0.2, 0.5, 1.0, 2.0}) {
      // While a limited force rises it is not proportional to the depth, as it is while it falls.
      // This costs a hundredth of the 32 mJ that the unlimited spring takes.
      EXPECT_LE(hit_mj(rise_n, most_n, 0), sampled_mj + 0.01 * 32.0)
          << rise_n << " N/ms, " << most_n << " N";
    }
  }
}

TEST(PassiveReturn, TakesNothingFromASpringThatWasLetInWhole) {
  PassiveReturn back;
  for (int ms = 0; ms <= 20; ++ms) {
    const double wanted = 4.0 * std::sin(std::numbers::pi * ms / 20.0);
    // An exact spring of 1 N/mm: the work since the last step.
    const double before = 4.0 * std::sin(std::numbers::pi * std::max(0, ms - 1) / 20.0);
    const double work = 0.5e-3 * (wanted * wanted - before * before);
    back.move(work, work);
    EXPECT_GE(back.most_n(wanted), wanted * (1.0 - 1e-12)) << ms;
    back.give(wanted, 1e-3);
  }
}

TEST(PassiveReturn, ComesBackSlowlyAfterAFallThatDidNotLeaveTheWall) {
  // The scene's force is 6 N where 4 N is the limit, falls to 5.4 N and rises slowly. On a beating
  // heart the force that the fall had removed came back in one millisecond.
  PassiveReturn back;
  double given = 0.0, worst_n = 0.0, least = 4.0;
  for (int ms = 0; ms < 600; ++ms) {
    const double wanted = ms < 100   ? 0.06 * ms
                          : ms < 200 ? 6.0
                          : ms < 300 ? 6.0 - 0.006 * (ms - 200)
                                     : 5.4 + 0.001 * (ms - 300);
    const double before = given;
    given = std::min({wanted, 4.0, back.most_n(wanted)});
    back.give(given, 1e-3);
    if (ms > 100) worst_n = std::max(worst_n, std::abs(given - before));
    if (ms > 200) least = std::min(least, given);
  }
  EXPECT_LT(least, 3.7) << "no force was held back: nothing is tested";
  EXPECT_LT(worst_n, 0.05);
  EXPECT_NEAR(given, 4.0, 0.01);
}

TEST(PassiveReturn, ForgivesWhatWasHeldBackWhereTheHandStays) {
  // After 0.5 s of rest more is returned than without rest; after a second the limit is gone.
  EXPECT_GT(hit_mj(0.2, 100.0, 500), hit_mj(0.2, 100.0, 0));
  PassiveReturn back;
  back.move(10e-3, 3e-3);
  for (int ms = 0; ms < 1000; ++ms) {
    EXPECT_EQ(back.most_n(4.0), std::numeric_limits<double>::infinity());
    back.give(4.0, 1e-3);
  }
  EXPECT_NEAR(back.most_n(3.0), 3.0, 0.01);
}

}  // namespace
}  // namespace palpate
