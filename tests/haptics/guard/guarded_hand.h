#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "module/haptics/force_vector.h"
#include "module/haptics/guard/safety.h"

namespace palpate::test {

/// A device like a Falcon, for tests of the guards.
inline DeviceInfo test_device() {
  DeviceInfo info;
  info.kind = "simulated";
  info.max_force_n = 8.0;
  info.workspace_centre_m = {0.0, 0.01, 0.13};
  info.workspace_radius_m = 0.05;
  info.buttons = 4;
  return info;
}

/// Steps the guards with an input without faults by default, and checks the guarantees of every
/// frame: finite, limited in magnitude and slew, zero where the state requires zero.
struct GuardedHand {
  explicit GuardedHand(const SafetyOptions& options = {}, const DeviceInfo& info = test_device())
      : safety(options, info) {
    input.reading.position_m = info.workspace_centre_m;
    input.reading.fresh = true;
  }

  const SafetyOutput& step() {
    const glm::dvec3 before = out.force_n;
    out = safety.step(input);
    ++frame;
    const SafetyOptions& o = safety.options();
    const double dt = input.dt_s >= 1e-6 ? std::min(input.dt_s, 2e-3) : 1e-3;
    // Rounding of a few operations on forces of some N.
    constexpr double kRounding = 1e-12;
    EXPECT_TRUE(is_finite(out.force_n)) << where();
    EXPECT_LE(glm::length(out.force_n), o.max_force_n + kRounding) << where();
    EXPECT_LE(glm::length(out.force_n - before), o.max_slew_n_per_s * dt + kRounding) << where();
    // Every newton between what was wanted and what is given is some limiter's.
    if (is_finite(input.wanted_n)) {
      EXPECT_EQ(out.ledger.asked_n, input.wanted_n) << where();
    }
    const double large = 1e-12 * length_of(out.ledger.asked_n);
    EXPECT_LE(length_of(out.ledger.left_n() - out.force_n), 1e-9 + large) << where();
    switch (out.state) {
      case SafetyState::kOff:
      case SafetyState::kWaiting:
      case SafetyState::kTripped:
        EXPECT_EQ(out.force_n, glm::dvec3(0.0)) << where();
        EXPECT_NE(out.cause, Cause::kNone) << where();
        EXPECT_FALSE(out.in_contact) << where();
        break;
      case SafetyState::kFading:
        EXPECT_LE(glm::length(out.force_n), glm::length(before)) << where();
        EXPECT_NE(out.cause, Cause::kNone) << where();
        break;
      case SafetyState::kRamping:
      case SafetyState::kOn:
        break;
    }
    return out;
  }
  const SafetyOutput& steps(int count) {
    for (int i = 0; i < count; ++i) step();
    return out;
  }
  /// With a free hand through the start gate and its ramp.
  void start() {
    input.wanted_n = glm::dvec3(0.0);
    input.touching = false;
    for (int i = 0; i < 3000 && out.state != SafetyState::kOn; ++i) step();
    ASSERT_EQ(out.state, SafetyState::kOn);
    ASSERT_EQ(out.cause, Cause::kNone);
  }
  /// Then into a contact of this force along x, until the contact is no longer new.
  void press(double newton) {
    start();
    input.wanted_n = {newton, 0, 0};
    input.touching = true;
    steps(60);
    ASSERT_NEAR(out.force_n.x, newton, 1e-9);
    ASSERT_TRUE(out.in_contact);
  }
  double newton() const { return glm::length(out.force_n); }
  std::string where() const { return label + " frame " + std::to_string(frame); }

  Safety safety;
  SafetyInput input;
  SafetyOutput out;
  int frame = 0;
  std::string label;
};

}  // namespace palpate::test
