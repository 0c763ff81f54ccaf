// Oracles: closed forms of the first-order heat model, of the energy budget, and of the slew limit
// of a new contact.
#include "module/haptics/guard/guards.h"

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

constexpr double kHitStiffness_n_per_m = 4000.0, kReturnRate_n_per_s = 50.0;

/// A grip in a spring of 4000 N/m whose force is limited to most_n, and rises by at most rise_n per
/// millisecond.
struct Hit {
  double rise_n, most_n;
  PassiveReturn back{kReturnRate_n_per_s};
  double x_mm = 0.0, wanted_n = 0.0, given_n = 0.0, work_mj = 0.0;

  void to(double mm) {
    work_mj -= given_n * (mm - x_mm);
    back.move(1e-3 * wanted_n * (mm - x_mm), 1e-3 * given_n * (mm - x_mm));
    x_mm = mm;
    const double spring_n = std::max(0.0, 1e-3 * kHitStiffness_n_per_m * mm);
    wanted_n = std::min(spring_n, most_n);
    given_n = std::min(
        {wanted_n, given_n + rise_n, back.most_n(spring_n, wanted_n, kHitStiffness_n_per_m, 1e-3)});
    back.give(given_n);
  }
};

/// The work on a grip that moves 4 mm in and out again as a sine, half_ms each, and rests between
/// for hold_ms, mJ.
double hit_mj(double rise_n, double most_n, int half_ms, int hold_ms) {
  Hit hit{rise_n, most_n};
  for (int ms = 1; ms <= 2 * half_ms + hold_ms; ++ms) {
    const int phase = ms <= half_ms ? ms : std::max(half_ms, ms - hold_ms);
    hit.to(4.0 * std::sin(0.5 * std::numbers::pi * phase / half_ms));
  }
  return hit.work_mj;
}

TEST(PassiveReturn, GivesAHitNoMoreBackThanItTook) {
  for (const int half_ms : {10, 20, 40}) {
    // The force is constant for a millisecond, so even an unlimited spring returns more energy than
    // it takes. This error of sampling is the reference.
    const double sampled_mj = hit_mj(1e9, 1e9, half_ms, 0);
    EXPECT_GT(sampled_mj, 0.0);
    for (const double most_n : {4.0, 8.0, 100.0}) {
      for (const double rise_n : {0.1, 0.2, 0.5, 1.0, 2.0}) {
        // A hundredth of the 32 mJ that the unlimited spring takes: the share follows the hand.
        EXPECT_LE(hit_mj(rise_n, most_n, half_ms, 0), sampled_mj + 0.01 * 32.0)
            << rise_n << " N/ms, " << most_n << " N, " << half_ms << " ms";
      }
    }
  }
}

TEST(PassiveReturn, TakesNothingFromASpringThatWasLetInWhole) {
  for (const double most_n : {4.0, 100.0}) {
    Hit hit{1e9, most_n};
    for (int ms = 0; ms <= 20; ++ms) {
      hit.to(4.0 * std::sin(std::numbers::pi * ms / 20.0));
      EXPECT_EQ(hit.given_n, hit.wanted_n) << ms;
    }
  }
}

TEST(PassiveReturn, LeavesAForceAloneThatChangesWithoutTheHand) {
  // A wall that moves under a resting hand: the force is limited while it rises, then falls.
  PassiveReturn back(kReturnRate_n_per_s);
  double given_n = 0.0;
  for (int ms = 0; ms < 600; ++ms) {
    const double wanted_n = 2.0 + 1.5 * std::sin(0.02 * ms);
    // A hand that is nearly still: its work is noise of either sign.
    const double work_j = (ms % 2 ? 1e-6 : -1e-6) * wanted_n;
    back.move(work_j, work_j * given_n / wanted_n);
    given_n = std::min(
        {wanted_n, given_n + 0.1, back.most_n(wanted_n, wanted_n, kHitStiffness_n_per_m, 1e-3)});
    back.give(given_n);
    if (ms > 30) {
      ASSERT_NEAR(given_n, wanted_n, 5e-3) << ms;
    }
  }
}

TEST(PassiveReturn, FallsWithTheHandAndComesBackAtItsRate) {
  Hit hit{0.2, 100.0};
  for (int ms = 1; ms <= 10; ++ms) hit.to(0.1 * ms);
  // The hand withdraws slowly: the force may fall by what its way unloads the spring, once for the
  // spring and once for the share.
  for (int ms = 1; ms <= 20; ++ms) {
    const double before_n = hit.given_n;
    hit.to(1.0 - 0.01 * ms);
    ASSERT_GE(hit.given_n, before_n - 2.0 * 0.04 - 1e-9) << ms;
  }
  ASSERT_LT(hit.given_n, 0.8 * hit.wanted_n) << "nothing was held back: nothing is tested";
  hit.rise_n = 1e9;
  for (int ms = 1; hit.given_n < hit.wanted_n; ++ms) {
    const double before_n = hit.given_n;
    hit.to(0.8);
    ASSERT_LE(hit.given_n, before_n + 1e-3 * kReturnRate_n_per_s + 1e-9) << ms;
    ASSERT_LT(ms, 60);
  }
}

TEST(PassiveReturn, ForgivesWhatWasHeldBackWhereTheHandStays) {
  EXPECT_GT(hit_mj(0.2, 100.0, 10, 500), hit_mj(0.2, 100.0, 10, 0));
  Hit hit{0.2, 100.0};
  for (int ms = 0; ms < 1500; ++ms) hit.to(1.0);
  hit.to(0.9);
  EXPECT_NEAR(hit.given_n, 3.6, 0.01);
}

}  // namespace
}  // namespace palpate
