// Oracles: the closed form of a critically damped spring; the limits that the class documents; and
// class Safety, which decides whether a force of this "device" is passed as the scene gives it.

#include "module/haptics/servo/position_source.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <thread>

#include "module/haptics/guard/safety.h"

namespace palpate {
namespace {

TEST(Follower, FollowsTheClosedFormOfACriticallyDampedSpring) {
  const double w = 50.0;
  Follower follower(glm::dvec3(0.0), w, 1e3);
  const glm::dvec3 target(0.01, -0.02, 0.03);
  for (int k = 1; k <= 200; ++k) {
    const glm::dvec3 place = follower.step(target, 1e-3);
    const double t = 1e-3 * k, left = (1.0 + w * t) * std::exp(-w * t);
    // The steps are solved exactly: only rounding is left.
    EXPECT_LE(glm::distance(place, target * (1.0 - left)), 1e-14) << k;
  }
}

TEST(Follower, GivesTheSameForAnyCutOfTheTime) {
  Follower coarse(glm::dvec3(0.0), 60.0, 1e3), fine(glm::dvec3(0.0), 60.0, 1e3);
  const glm::dvec3 target(0.05, 0.0, 0.0);
  coarse.step(target, 0.05);
  for (int k = 0; k < 50; ++k) fine.step(target, 1e-3);
  EXPECT_LE(glm::distance(coarse.place_m(), fine.place_m()), 1e-14);
}

TEST(Follower, NeverIsFasterThanItMayAndHasNoSteps) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> across(-0.1, 0.1), chance(0.0, 1.0), late(0.2e-3, 4e-3);
  const double most = 0.75, w = 60.0;
  Follower follower(glm::dvec3(0.0), w, most);
  glm::dvec3 target(0.0), place(0.0), velocity(0.0);
  for (int k = 0; k < 20000; ++k) {
    if (chance(random) < 0.02) target = {across(random), across(random), across(random)};
    const double dt = late(random);
    follower.step(target, dt);
    // Within a step the pull changes a velocity by 2 w v dt at most. Speeds are limited to v at the
    // ends of the step, so the way is at most that of v and of this change.
    EXPECT_LE(glm::distance(follower.place_m(), place), most * dt * (1.0 + 2.0 * w * dt)) << k;
    EXPECT_LE(glm::length(follower.velocity_m_per_s()), most * (1.0 + 1e-12)) << k;
    EXPECT_LE(glm::distance(follower.velocity_m_per_s(), velocity), 4.0 * w * most * dt) << k;
    place = follower.place_m();
    velocity = follower.velocity_m_per_s();
  }
}

TEST(Follower, DoesNotOvershootFromRest) {
  Follower follower(glm::dvec3(0.0), 60.0, 0.75);
  double before = 0.0;
  for (int k = 0; k < 2000; ++k) {
    const double x = follower.step({0.1, 0.0, 0.0}, 1e-3).x;
    EXPECT_GE(x, before) << k;
    EXPECT_LE(x, 0.1 + 1e-15) << k;
    before = x;
  }
  EXPECT_NEAR(before, 0.1, 1e-9);
}

TEST(Follower, StaysWhereItIsForWhatIsNoNumber) {
  Follower follower(glm::dvec3(0.01), 60.0, 0.75);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  follower.step({nan, 0.0, 0.0}, 1e-3);
  follower.step({0.0, 0.0, 0.0}, nan);
  follower.step({0.0, 0.0, 0.0}, -1.0);
  EXPECT_EQ(follower.place_m(), glm::dvec3(0.01));
}

TEST(PositionSource, GivesAFreshPlaceForEveryExchange) {
  PositionSource probe;
  probe.hold({0.01, 0.02, -0.03}, 1);
  int64_t now = 1'000'000'000;
  DeviceReading reading;
  for (int k = 0; k < 1000; ++k, now += 1'000'000) {
    reading = probe.exchange_at(now);
    EXPECT_TRUE(reading.fresh);
    EXPECT_EQ(reading.fault, DeviceFault::kNone);
    EXPECT_EQ(reading.time_ns, now);
    EXPECT_EQ(reading.buttons, 1u);
  }
  // After 60 settling times only rounding is left.
  EXPECT_LE(glm::distance(reading.position_m, {0.01, 0.02, -0.03}), 1e-9);
}

TEST(PositionSource, StaysWithinItsWorkspaceAndIgnoresWhatIsNoPlace) {
  PositionSource probe;
  const double reach = probe.info().workspace_radius_m;
  probe.hold({10.0, 10.0, 10.0}, 0);
  probe.hold({std::numeric_limits<double>::infinity(), 0.0, 0.0}, 0);
  DeviceReading reading;
  for (int64_t k = 0; k < 2000; ++k) {
    reading = probe.exchange_at(k * 1'000'000);
    ASSERT_LE(glm::length(reading.position_m), reach * (1.0 + 1e-12)) << k;
  }
  EXPECT_NEAR(glm::length(reading.position_m), reach, 1e-9);
}

TEST(PositionSource, DoesNotMakeUpForASleepInOneJump) {
  PositionSource probe;
  probe.exchange_at(0);
  probe.hold({0.05, 0.0, 0.0}, 0);
  const PositionSourceOptions options;
  const DeviceReading reading = probe.exchange_at(5'000'000'000);
  EXPECT_LE(glm::length(reading.position_m), 0.010 * options.speed_m_per_s);
}

TEST(PositionSource, IsGoneWhenNobodyHoldsItAndBeginsWhereItIsTakenAgain) {
  PositionSourceOptions options;
  options.waits = true;
  PositionSource probe(options);
  int64_t now = 1'000'000'000;
  const auto after = [&](int ms) {
    DeviceReading reading;
    for (int k = 0; k < ms; ++k, now += 1'000'000) reading = probe.exchange_at(now);
    return reading;
  };
  EXPECT_EQ(after(1).fault, DeviceFault::kNoHand);
  probe.hold({0.02, 0.0, 0.0}, 1);
  EXPECT_EQ(after(1).fault, DeviceFault::kNone);
  EXPECT_EQ(after(1).position_m, glm::dvec3(0.02, 0.0, 0.0))
      << "at the new place, not on the way to it";
  probe.hold({0.03, 0.0, 0.0}, 1);
  const glm::dvec3 last = after(10).position_m;
  probe.let_go();
  const DeviceReading gone = after(500);
  EXPECT_EQ(gone.fault, DeviceFault::kNoHand);
  EXPECT_EQ(gone.position_m, last) << "the last good one";
  EXPECT_EQ(gone.buttons, 0u);
  probe.hold({-0.04, 0.01, 0.0}, 0);
  EXPECT_EQ(after(1).position_m, glm::dvec3(-0.04, 0.01, 0.0));
}

TEST(PositionSource, IsMovedByOneThreadAndReadByAnother) {
  PositionSource probe;
  std::jthread window([&](std::stop_token stop) {
    for (int k = 0; !stop.stop_requested(); ++k) probe.hold(glm::dvec3(k % 2 ? 0.02 : -0.02), 0);
  });
  // The source was given two places only: every reading must be on the line between them.
  for (int64_t k = 0; k < 20000; ++k) {
    const glm::dvec3 at = probe.exchange_at(k * 1'000'000).position_m;
    ASSERT_NEAR(at.x, at.y, 1e-12);
    ASSERT_NEAR(at.x, at.z, 1e-12);
    ASSERT_LE(std::abs(at.x), 0.0201);
  }
}

/// The force that is passed after ten minutes of `force_n` without motion, after the start ramp.
double force_after_ten_minutes(double force_n, double scene_most_n) {
  PositionSource probe;
  SafetyOptions options;
  options.max_force_n = scene_most_n;
  Safety safety(options, probe.info());
  SafetyOutput out;
  const int ramp = 4000, held = 600'000;
  for (int k = 0; k < ramp + held; ++k) {
    SafetyInput input;
    input.reading = probe.exchange_at(int64_t(k) * 1'000'000);
    input.wanted_n = {0.0, k < ramp ? 0.0 : force_n, 0.0};
    input.touching = k >= ramp;
    out = safety.step(input);
  }
  EXPECT_EQ(out.state, SafetyState::kOn);
  EXPECT_EQ(out.cause, Cause::kNone);
  return out.force_n.y;
}

TEST(PositionSource, LetsTheGuardsGiveTheForceThatTheArrowShows) {
  // The whole force; only the slew's last step rounds.
  EXPECT_NEAR(force_after_ten_minutes(3.0, 4.0), 3.0, 1e-9);
  // The scene's limit acts, not a device's; there is no motor that could get hot.
  EXPECT_NEAR(force_after_ten_minutes(50.0, 4.0), 4.0, 1e-9);
  EXPECT_NEAR(force_after_ten_minutes(90.0, 100.0), 90.0, 1e-9);
}

TEST(PositionSource, ThatWaitsBeginsWhereItIsHeldFirstAndIsNotDrawnThere) {
  PositionSource probe({.kind = "controller", .waits = true, .workspace_radius_m = 1.0});
  EXPECT_EQ(probe.info().kind, "controller");
  for (int k = 0; k < 10; ++k) {
    const DeviceReading nothing = probe.exchange_at(1'000'000 * k);
    EXPECT_NE(nothing.fault, DeviceFault::kNone);
    EXPECT_FALSE(nothing.fresh);
  }
  const glm::dvec3 place(0.3, -0.2, 0.1);
  probe.hold(place, 0);
  const DeviceReading first = probe.exchange_at(11'000'000);
  EXPECT_EQ(first.fault, DeviceFault::kNone);
  EXPECT_TRUE(first.fresh);
  EXPECT_EQ(first.position_m, place);
}

}  // namespace
}  // namespace palpate
