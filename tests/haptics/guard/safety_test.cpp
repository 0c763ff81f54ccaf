// Each guard alone, in closed form. GuardedHand checks finite, magnitude and slew in every frame.
#include "module/haptics/guard/safety.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <set>

#include "tests/haptics/guard/guarded_hand.h"

namespace palpate {
namespace {

using test::GuardedHand;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kTwoPi = 6.283185307179586;
constexpr double kRounding = 1e-9;

// ---- Start gate

TEST(StartGate, WaitsUntilTheHandIsFree) {
  GuardedHand hand;
  hand.input.wanted_n = {0.5, 0, 0};
  hand.steps(500);
  EXPECT_EQ(hand.out.state, SafetyState::kWaiting);
  EXPECT_EQ(hand.out.cause, Cause::kStarting);
  hand.input.wanted_n = {0.1, 0, 0};
  hand.steps(2);
  // Two free frames are not enough, three are needed.
  hand.input.wanted_n = {0.3, 0, 0};
  hand.step();
  hand.input.wanted_n = {0.1, 0, 0};
  hand.steps(2);
  EXPECT_EQ(hand.out.state, SafetyState::kWaiting);
  hand.step();
  EXPECT_EQ(hand.out.state, SafetyState::kRamping);
}

TEST(StartGate, LetsTheForceInOverTwoSeconds) {
  GuardedHand hand;
  hand.steps(3);
  ASSERT_EQ(hand.out.state, SafetyState::kRamping);
  hand.input.wanted_n = {3.0, 0, 0};
  for (int ms = 1; ms <= 2000; ++ms) {
    hand.step();
    ASSERT_NEAR(hand.newton(), 3.0 * 1e-3 * ms / 2.0, kRounding) << ms;
    if (ms < 2000) {
      ASSERT_EQ(hand.out.cause, Cause::kStarting);
    }
  }
  hand.step();
  EXPECT_EQ(hand.out.state, SafetyState::kOn);
  EXPECT_EQ(hand.out.cause, Cause::kNone);
}

TEST(StartGate, DampsTheHandWhileItRamps) {
  GuardedHand hand;
  hand.input.velocity_m_per_s = {0.0, 0.5, 0.0};
  hand.steps(3);
  for (int ms = 1; ms <= 1999; ++ms) {
    hand.step();
    const double ramp = 1e-3 * ms / 2.0;
    // A fifth of 5 N s/m: rises over the first tenth of the ramp, then falls with the ramp.
    const double damping = 0.2 * 5.0 * std::min(10.0 * ramp, 1.0) * (1.0 - ramp);
    ASSERT_NEAR(hand.out.force_n.y, -damping * 0.5, kRounding) << ms;
  }
  hand.steps(2);
  EXPECT_NEAR(hand.newton(), 0.0, kRounding);
}

// ---- What brings the force to zero

struct Fault {
  const char* name;
  Cause cause;
  std::function<void(SafetyInput&)> bring;
};

std::vector<Fault> faults() {
  std::vector<Fault> list = {
      {"stop", Cause::kStopped, [](SafetyInput& in) { in.stop = true; }},
      {"late", Cause::kLate, [](SafetyInput& in) { in.late = true; }},
      {"5 ms", Cause::kLate, [](SafetyInput& in) { in.dt_s = 0.005; }},
      {"50 ms", Cause::kLate, [](SafetyInput& in) { in.dt_s = 0.05; }},
      {"500 ms", Cause::kLate, [](SafetyInput& in) { in.dt_s = 0.5; }},
      {"hour", Cause::kClock, [](SafetyInput& in) { in.dt_s = 3600.0; }},
      {"dt 0", Cause::kClock, [](SafetyInput& in) { in.dt_s = 0.0; }},
      {"dt < 0", Cause::kClock, [](SafetyInput& in) { in.dt_s = -1e-3; }},
      {"dt NaN", Cause::kClock, [](SafetyInput& in) { in.dt_s = kNan; }},
      {"dt inf", Cause::kClock, [](SafetyInput& in) { in.dt_s = kInf; }},
      {"button", Cause::kDeadMan, [](SafetyInput& in) { in.reading.buttons = 0; }},
      {"other button", Cause::kDeadMan, [](SafetyInput& in) { in.reading.buttons = 2; }},
  };
  for (double bad : {kNan, kInf, -kInf}) {
    list.push_back({"force", Cause::kNotFinite, [bad](SafetyInput& in) { in.wanted_n.y = bad; }});
    list.push_back(
        {"velocity", Cause::kNotFinite, [bad](SafetyInput& in) { in.velocity_m_per_s.z = bad; }});
    list.push_back(
        {"position", Cause::kNotFinite, [bad](SafetyInput& in) { in.reading.position_m.x = bad; }});
  }
  for (int f = 1; f <= int(DeviceFault::kNoLibrary); ++f)
    list.push_back({sentence(DeviceFault(f)), Cause::kDevice,
                    [f](SafetyInput& in) { in.reading.fault = DeviceFault(f); }});
  return list;
}

SafetyOptions with_dead_man() {
  SafetyOptions options;
  options.dead_man = true;
  options.dead_man_buttons = 1;
  return options;
}

TEST(Safety, FallsOnAStraightRampFromTheFirstFrameOfEachFault) {
  for (const Fault& fault : faults()) {
    GuardedHand hand(with_dead_man());
    hand.label = fault.name;
    hand.input.reading.buttons = 1;
    hand.press(3.0);
    const SafetyInput well = hand.input;
    fault.bring(hand.input);
    const double dt = hand.input.dt_s > 0.0 ? std::min(hand.input.dt_s, 2e-3) : 1e-3;
    const int frames = int(std::ceil(0.020 / dt - 1e-9));
    for (int i = 1; i <= frames + 5; ++i) {
      hand.step();
      ASSERT_NEAR(hand.newton(), std::max(0.0, 3.0 * (1.0 - i * dt / 0.020)), kRounding)
          << hand.where();
      ASSERT_EQ(hand.out.cause, fault.cause) << hand.where();
      if (i > frames) {
        ASSERT_EQ(hand.newton(), 0.0) << hand.where();
      }
    }
    // The fault is over, but the hand is still at the wall: the force is zero, and the cause stays
    // until the hand is free.
    hand.input = well;
    hand.steps(50);
    EXPECT_EQ(hand.newton(), 0.0) << fault.name;
    EXPECT_EQ(hand.out.cause, fault.cause) << fault.name;
    EXPECT_EQ(hand.out.state,
              fault.cause == Cause::kStopped ? SafetyState::kTripped : SafetyState::kWaiting)
        << fault.name;
    hand.input.rearm = true;
    hand.step();
    hand.input.rearm = false;
    hand.start();
    EXPECT_EQ(hand.out.cause, Cause::kNone) << fault.name;
  }
}

TEST(Safety, FinishesItsRampWhenTheFaultLastsOneFrame) {
  for (const Fault& fault : faults()) {
    GuardedHand hand(with_dead_man());
    hand.label = fault.name;
    hand.input.reading.buttons = 1;
    hand.press(2.0);
    const SafetyInput well = hand.input;
    fault.bring(hand.input);
    hand.step();
    hand.input = well;
    hand.steps(20);
    EXPECT_EQ(hand.newton(), 0.0) << fault.name;
    EXPECT_EQ(hand.out.cause, fault.cause) << fault.name;
  }
}

TEST(Safety, StaysOffWhileTheFaultLastsAndNamesWhatIsInTheWay) {
  GuardedHand hand(with_dead_man());
  hand.input.reading.buttons = 1;
  hand.press(2.0);
  hand.input.late = true;
  hand.step();
  hand.input.late = false;
  hand.input.reading.fault = DeviceFault::kUnplugged;
  hand.steps(5);
  // The first cause, while the force fades.
  EXPECT_EQ(hand.out.cause, Cause::kLate);
  hand.steps(100);
  EXPECT_EQ(hand.out.state, SafetyState::kOff);
  EXPECT_EQ(hand.out.cause, Cause::kDevice);
  hand.input.reading.fault = DeviceFault::kNone;
  hand.input.reading.buttons = 0;
  hand.input.wanted_n = glm::dvec3(0.0);
  hand.steps(100);
  EXPECT_EQ(hand.out.state, SafetyState::kOff);
  EXPECT_EQ(hand.out.cause, Cause::kDeadMan);
  hand.input.reading.buttons = 1;
  hand.start();
}

TEST(Safety, StaysStoppedUntilRearmed) {
  GuardedHand hand;
  hand.press(2.0);
  hand.input.stop = true;
  hand.steps(30);
  hand.input.stop = false;
  hand.input.wanted_n = glm::dvec3(0.0);
  hand.steps(5000);
  EXPECT_EQ(hand.out.state, SafetyState::kTripped);
  EXPECT_EQ(hand.out.cause, Cause::kStopped);
  // While stop is set, rearm has no effect.
  hand.input.stop = hand.input.rearm = true;
  hand.steps(10);
  EXPECT_EQ(hand.out.state, SafetyState::kTripped);
  hand.input.stop = false;
  hand.step();
  hand.input.rearm = false;
  hand.start();
}

TEST(Safety, TakesAPositionThatDoesNotComeAnewForAFault) {
  GuardedHand hand;
  hand.press(2.0);
  hand.input.reading.fresh = false;
  hand.steps(19);
  EXPECT_EQ(hand.out.state, SafetyState::kOn);
  hand.steps(2);
  EXPECT_EQ(hand.out.state, SafetyState::kFading);
  EXPECT_EQ(hand.out.cause, Cause::kDevice);
  // A device that answers in every fourth frame has no fault.
  GuardedHand slow;
  slow.press(2.0);
  for (int i = 0; i < 200; ++i) {
    slow.input.reading.fresh = i % 4 == 0;
    slow.step();
  }
  EXPECT_EQ(slow.out.state, SafetyState::kOn);
}

TEST(Safety, NeverStartsWithoutTheButton) {
  GuardedHand hand(with_dead_man());
  hand.steps(3000);
  EXPECT_EQ(hand.out.state, SafetyState::kOff);
  EXPECT_EQ(hand.out.cause, Cause::kDeadMan);
  GuardedHand free_of_it;
  free_of_it.start();
}

// ---- What limits the force

TEST(Safety, LetsAForceWithinItsLimitsThroughUnchanged) {
  GuardedHand hand;
  hand.start();
  glm::dvec3 force(0.0);
  hand.input.velocity_m_per_s = {0.05, 0, 0};
  for (int i = 0; i < 2000; ++i) {
    force = {1.2 * std::sin(1e-3 * kTwoPi * i), 0.8 * std::sin(2e-3 * kTwoPi * i), 0.0};
    hand.input.wanted_n = force;
    hand.step();
    ASSERT_NEAR(glm::length(hand.out.force_n - force), 0.0, 1e-12) << i;
    ASSERT_EQ(hand.out.cause, Cause::kNone) << i;
  }
}

TEST(Safety, CutsTheForceAndKeepsItsDirection) {
  for (double size : {10.0, 1e6, 1e200, 1e308}) {
    GuardedHand hand;
    hand.start();
    hand.input.wanted_n = size * glm::dvec3(0.6, -0.8, 0.0);
    hand.steps(20);
    EXPECT_NEAR(glm::length(hand.out.force_n - glm::dvec3(2.4, -3.2, 0.0)), 0.0, kRounding) << size;
  }
  DeviceInfo weak = test::test_device();
  weak.max_force_n = 1.5;
  // Unknown radius: no edge.
  weak.workspace_radius_m = 0.0;
  GuardedHand hand({}, weak);
  hand.start();
  hand.input.wanted_n = {0, 0, 100};
  hand.steps(20);
  EXPECT_NEAR(hand.newton(), 1.5, kRounding);
}

TEST(Safety, LetsNoForceStepThrough) {
  GuardedHand hand;
  hand.start();
  hand.input.wanted_n = {3.6, 0, 0};
  for (int i = 1; i <= 2; ++i) {
    hand.step();
    // Nine tenths of 2,000 N/s: see Safety.
    EXPECT_NEAR(hand.newton(), 1.8 * i, kRounding);
  }
  // A longer frame that is not yet late gets at most 2 ms' worth.
  hand.input.dt_s = 0.004;
  hand.input.wanted_n = {-3.6, 0, 0};
  hand.step();
  EXPECT_NEAR(hand.out.force_n.x, 0.0, kRounding);
}

TEST(Safety, DampsAboveTheVelocityLimit) {
  GuardedHand hand;
  hand.start();
  hand.input.velocity_m_per_s = {0.0, 0.0, 1.9};
  hand.steps(500);
  EXPECT_NEAR(hand.out.force_n.z, -5.0 * 0.4, kRounding);
  EXPECT_EQ(hand.out.cause, Cause::kTooFast);
  EXPECT_EQ(hand.out.state, SafetyState::kOn);
  hand.input.velocity_m_per_s = {0.0, 0.0, 1.5};
  hand.steps(5);
  EXPECT_EQ(hand.newton(), 0.0);
  EXPECT_EQ(hand.out.cause, Cause::kNone);
}

TEST(Safety, SwitchesOffWhenFarTooFastForLong) {
  GuardedHand hand;
  hand.start();
  hand.input.velocity_m_per_s = {3.5, 0.0, 0.0};
  hand.steps(15);
  EXPECT_EQ(hand.out.state, SafetyState::kOn);
  // A short jerk is no fault.
  hand.input.velocity_m_per_s = {0.5, 0.0, 0.0};
  hand.steps(30);
  hand.input.velocity_m_per_s = {1e300, 1e300, 0.0};
  hand.steps(22);
  EXPECT_EQ(hand.out.state, SafetyState::kFading);
  EXPECT_EQ(hand.out.cause, Cause::kTooFast);
  hand.input.velocity_m_per_s = {0.1, 0.0, 0.0};
  hand.start();
}

TEST(Safety, FadesWhatPushesOutwardsAtTheEdgeOfTheWorkspace) {
  const DeviceInfo info = test::test_device();
  const glm::dvec3 outward = glm::normalize(glm::dvec3(1, 2, -2)), along(0, 1, 1);
  for (double r : {0.0, 0.03, 0.046, 0.047, 0.048, 0.049, 0.05, 0.06, 1.0}) {
    GuardedHand hand;
    hand.input.reading.position_m = info.workspace_centre_m + r * outward;
    hand.start();
    const double left = std::clamp((0.05 - r) / 0.004, 0.0, 1.0);
    hand.input.wanted_n = 1.5 * outward + 0.5 * along;
    hand.steps(20);
    EXPECT_NEAR(glm::length(hand.out.force_n - (left * 1.5 * outward + 0.5 * along)), 0.0,
                kRounding)
        << r;
    EXPECT_EQ(hand.out.cause, left < 1.0 ? Cause::kWorkspaceEdge : Cause::kNone) << r;
    // Leads away from the stop.
    hand.input.wanted_n = -1.5 * outward + 0.5 * along;
    hand.steps(20);
    EXPECT_NEAR(glm::length(hand.out.force_n - hand.input.wanted_n), 0.0, kRounding) << r;
    EXPECT_EQ(hand.out.cause, Cause::kNone) << r;
  }
}

TEST(Safety, LetsTheFirstTouchInSlowly) {
  GuardedHand hand;
  hand.start();
  hand.input.wanted_n = {3.0, 0, 0};
  hand.input.touching = true;
  for (int ms = 1; ms <= 11; ++ms) {
    hand.step();
    ASSERT_NEAR(hand.newton(), 0.2 * ms, kRounding) << ms;
    ASSERT_EQ(hand.out.cause, Cause::kFirstContact) << ms;
  }
  hand.steps(10);
  EXPECT_NEAR(hand.newton(), 3.0, kRounding);
  // A falling force is never slowed.
  hand.input.wanted_n = glm::dvec3(0.0);
  hand.steps(2);
  EXPECT_EQ(hand.newton(), 0.0);
  // The same contact: it is no longer new.
  hand.input.wanted_n = {3.0, 0, 0};
  hand.steps(2);
  EXPECT_NEAR(hand.newton(), 3.0, kRounding);
}

TEST(Safety, TurnsABuzzDownAndTripsIfThatDoesNotHelp) {
  // The loop shakes where the spring's force is the hand's motion, the scene where the hand rests.
  for (const Cause cause : {Cause::kOscillation, Cause::kShaking}) {
    SCOPED_TRACE(word(cause));
    GuardedHand hand;
    hand.input.stiffness_n_per_m = 3000.0;
    hand.start();
    const glm::dvec3 rest_m = hand.input.reading.position_m;
    std::set<Cause> causes;
    for (int i = 0; i < 3000 && hand.out.state != SafetyState::kTripped; ++i) {
      // 80 Hz, not affected by the gain.
      hand.input.wanted_n = {3.5 * std::sin(0.08 * kTwoPi * i), 0, 0};
      if (cause == Cause::kOscillation)
        hand.input.reading.position_m = rest_m - hand.input.wanted_n / hand.input.stiffness_n_per_m;
      hand.step();
      causes.insert(hand.out.cause);
    }
    EXPECT_EQ(hand.out.state, SafetyState::kTripped);
    EXPECT_EQ(causes, (std::set<Cause>{Cause::kNone, cause}));
    hand.input.wanted_n = glm::dvec3(0.0);
    hand.steps(3000);
    EXPECT_EQ(hand.out.state, SafetyState::kTripped);
    hand.input.rearm = true;
    hand.step();
    hand.input.rearm = false;
    hand.start();
  }
}

TEST(Safety, LowersTheForceOfHotMotorsWithoutAStep) {
  SafetyOptions options;
  options.continuous_force_n = 1.0;
  options.thermal_s = 5.0;
  GuardedHand hand(options);
  hand.press(4.0);
  double last = 4.0;
  for (int i = 0; i < 40000; ++i) {
    hand.step();
    // At most (16 - 0.8) / 5 s of heat per second, times (4 - 1) N / 0.2: 46 N/s.
    ASSERT_NEAR(hand.newton(), last, 0.05) << i;
    last = hand.newton();
  }
  EXPECT_NEAR(last, 1.0, 1e-2);
  EXPECT_EQ(hand.out.cause, Cause::kHot);
  EXPECT_EQ(hand.out.state, SafetyState::kOn);
  hand.input.wanted_n = {0.9, 0, 0};
  hand.steps(100);
  EXPECT_EQ(hand.out.cause, Cause::kNone);
}

TEST(Safety, GivesTheHandNoMorePowerThanItMay) {
  GuardedHand hand;
  hand.press(4.0);
  double given = 0.0;
  bool named = false;
  for (int i = 0; i < 5000; ++i) {
    const glm::dvec3 step(1e-3 * (i % 100 < 50 ? 1.0 : -1.0), 0, 0);
    hand.input.reading.position_m += step;
    hand.input.velocity_m_per_s = step / 1e-3;
    // 4 W, always along the motion.
    hand.input.wanted_n = {step.x > 0.0 ? 4.0 : -4.0, 0, 0};
    given += glm::dot(hand.out.force_n, step);
    hand.step();
    named = named || hand.out.cause == Cause::kEnergy;
    ASSERT_LE(given, 0.5 + 2.0 * 1e-3 * (i + 1) + 1e-9) << i;
  }
  // The force reaches the limit.
  EXPECT_GT(given, 5.0);
  EXPECT_TRUE(named);
}

TEST(Safety, ReportsWhatTheSceneHasFadedItself) {
  GuardedHand hand;
  hand.start();
  for (Cause cause : {Cause::kField, Cause::kConfidence, Cause::kSceneEmpty}) {
    hand.input.scene = cause;
    hand.input.wanted_n = {1.0, 0, 0};
    hand.steps(5);
    EXPECT_EQ(hand.out.cause, cause);
    EXPECT_EQ(hand.out.state, SafetyState::kOn);
    EXPECT_NEAR(hand.newton(), 1.0, kRounding);
  }
}

TEST(Safety, TakesItsDefaultsForOptionsThatMakeNoSense) {
  SafetyOptions bad;
  for (double SafetyOptions::*member :
       {&SafetyOptions::max_force_n, &SafetyOptions::max_slew_n_per_s, &SafetyOptions::off_ramp_s,
        &SafetyOptions::start_force_n, &SafetyOptions::start_ramp_s, &SafetyOptions::start_damping,
        &SafetyOptions::max_damping_n_s_per_m, &SafetyOptions::max_speed_m_per_s,
        &SafetyOptions::too_fast_s, &SafetyOptions::edge_m, &SafetyOptions::first_contact_n_per_s,
        &SafetyOptions::first_contact_s, &SafetyOptions::buzz_n, &SafetyOptions::thermal_s,
        &SafetyOptions::continuous_force_n, &SafetyOptions::late_s, &SafetyOptions::stale_s,
        &SafetyOptions::max_power_w, &SafetyOptions::burst_j}) {
    for (double value : {kNan, -1.0, kInf}) {
      bad = SafetyOptions();
      bad.*member = value;
      GuardedHand hand(bad);
      hand.press(2.0);
    }
  }
  bad = SafetyOptions();
  bad.start_frames = -5;
  // Shorter than the slew limit allows: it is lengthened.
  bad.off_ramp_s = 1e-9;
  GuardedHand hand(bad);
  hand.press(3.0);
  hand.input.stop = true;
  hand.steps(3);
  EXPECT_EQ(hand.newton(), 0.0);
}

// ---- Torque

TEST(Torque, PassesTheLimitsOfAForceAtTheEndOfItsLever) {
  constexpr double kLever_m = 0.01;
  DeviceInfo device = test::test_device();
  device.max_torque_n_m = 0.03;
  for (const bool gives : {false, true}) {
    SCOPED_TRACE(gives);
    GuardedHand hand({}, gives ? device : test::test_device());
    hand.input.lever_m = kLever_m;
    double most_n_m = 0.0, step_n_m = 0.0;
    const auto steps = [&](int count) {
      for (int k = 0; k < count; ++k) {
        const glm::dvec3 before = hand.out.torque_n_m;
        hand.step();
        step_n_m = std::max(step_n_m, glm::distance(hand.out.torque_n_m, before));
        most_n_m = std::max(most_n_m, glm::length(hand.out.torque_n_m));
      }
    };
    hand.steps(3);
    // The start ramp.
    hand.input.wanted_n = {2.0, 0, 0};
    hand.input.wanted_torque_n_m = {0, 0.02, 0};
    steps(1000);
    EXPECT_NEAR(hand.out.torque_n_m.y, 0.01, kRounding);
    steps(1100);
    EXPECT_NEAR(hand.out.torque_n_m.y, 0.02, kRounding);
    // Magnitude: that of a force at the lever, and of the device.
    hand.input.wanted_torque_n_m = {0, 0, -5.0};
    steps(100);
    const double limit_n_m =
        gives ? device.max_torque_n_m : kLever_m * hand.safety.options().max_force_n;
    EXPECT_NEAR(hand.out.torque_n_m.z, -limit_n_m, kRounding);
    // The off ramp, from there to zero with the force.
    hand.input.late = true;
    steps(1);
    hand.input.late = false;
    EXPECT_LT(glm::length(hand.out.torque_n_m), limit_n_m);
    steps(30);
    EXPECT_EQ(hand.out.torque_n_m, glm::dvec3(0.0));
    EXPECT_EQ(hand.out.force_n, glm::dvec3(0.0));
    EXPECT_LE(most_n_m, limit_n_m + kRounding);
    EXPECT_LE(step_n_m, kLever_m * hand.safety.options().max_slew_n_per_s * 1e-3 + kRounding);
  }
}

TEST(Torque, ThatIsNotFiniteEndsTheForce) {
  GuardedHand hand;
  hand.input.lever_m = 0.01;
  hand.steps(2100);
  hand.input.wanted_torque_n_m = {0, kNan, 0};
  hand.step();
  EXPECT_EQ(hand.out.cause, Cause::kNotFinite);
  EXPECT_TRUE(is_finite(hand.out.torque_n_m));
}

TEST(Torque, DoesWorkOnAHandThatTurns) {
  DeviceInfo device = test::test_device();
  device.max_torque_n_m = 0.1;
  for (const bool gives : {false, true}) {
    GuardedHand hand({}, gives ? device : test::test_device());
    hand.input.lever_m = 0.01;
    hand.input.reading.grip.turns = true;
    hand.steps(2100);
    hand.input.wanted_torque_n_m = {0, 0.02, 0};
    hand.steps(100);
    hand.input.reading.grip.angular_velocity_rad_per_s = {0, 2.0, 0};
    const double before_j = hand.out.work_j;
    hand.steps(100);
    EXPECT_NEAR(hand.out.work_j - before_j, gives ? 0.1 * 2.0 * 0.02 : 0.0, 1e-6);
  }
}

}  // namespace
}  // namespace palpate
