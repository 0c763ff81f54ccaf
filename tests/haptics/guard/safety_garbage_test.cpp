// Seeded sequences of invalid input: for any input the output must keep its guarantees.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <set>

#include "tests/haptics/guard/guarded_hand.h"
#include "tests/support/random.h"

namespace palpate {
namespace {

using test::GuardedHand;
using test::Random;

double garbage(Random& random) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  constexpr double kList[] = {
      0.0,   -0.0,   1.0,     -1.0,      1e-320,     1e-160,
      1e160, -1e308, 1.7e308, kInfinite, -kInfinite, std::numeric_limits<double>::quiet_NaN()};
  return kList[size_t(random.draw(0.0, 12.0))];
}

glm::dvec3 vector(Random& random, double reach, double chance_of_garbage) {
  glm::dvec3 v = random.vector(reach);
  for (int a = 0; a < 3; ++a)
    if (random.draw(0, 1) < chance_of_garbage) v[a] = garbage(random);
  return v;
}

// A scene, a device and a clock that are valid for a while and then not.
struct Chaos {
  explicit Chaos(uint32_t seed) : random(seed) {}
  void next(SafetyInput& in) {
    if (left-- <= 0) {
      left = int(random.draw(1.0, 2500.0));
      bad = random.draw(0, 1) < 0.6 ? 0.0 : random.draw(0.0, 0.3);
      reach = random.draw(0.0, 6.0);
      pushing = random.draw(0, 1) < 0.2;
      push = random.vector(1e-3);
    }
    const auto happens = [&] { return random.draw(0, 1) < bad; };
    in.wanted_n = vector(random, left % 50 < 10 ? 0.1 : reach, 0.1 * bad);
    if (pushing && left % 50 >= 10)
      // Always along the last step: gives as much energy as it can.
      in.wanted_n = 4e3 * push;
    in.velocity_m_per_s = vector(random, 2.0, 0.1 * bad);
    const glm::dvec3 step = random.vector(1e-3);
    in.reading.position_m += pushing ? push : step;
    if (random.draw(0, 1) < 0.01) push = -push;
    if (happens() || !is_finite(in.reading.position_m) || length_of(in.reading.position_m) > 1.0)
      in.reading.position_m = vector(random, 0.1, bad);
    in.reading.fault = happens() ? DeviceFault(int(random.draw(0.0, 18.0))) : DeviceFault::kNone;
    in.reading.fresh = !happens();
    in.reading.buttons = uint32_t(random.draw(0.0, 4.0));
    in.dt_s = happens() ? (happens() ? garbage(random) : random.draw(-0.01, 2.0))
                        : random.draw(2e-4, 2e-3);
    in.late = happens() && happens();
    in.stop = happens() && happens() && happens();
    in.rearm = happens() || left == 1;
    in.touching = random.draw(0, 1) < 0.5;
    in.scene = happens() ? Cause::kField : Cause::kNone;
  }
  Random random;
  int left = 0;
  double bad = 0.0, reach = 1.0;
  bool pushing = false;
  glm::dvec3 push{0.0};
};

SafetyOptions options_of(Random& random) {
  SafetyOptions options;
  // Short, so that the force is on often.
  options.start_ramp_s = random.draw(0.001, 0.2);
  options.max_force_n = random.draw(1.0, 9.0);
  options.max_slew_n_per_s = random.draw(50.0, 5000.0);
  options.off_ramp_s = random.draw(0.0, 0.05);
  options.dead_man = random.draw(0, 1) < 0.2;
  options.dead_man_buttons = 3;
  options.max_power_w = random.draw(0.1, 3.0);
  options.continuous_force_n = random.draw(0.1, 3.0);
  options.thermal_s = random.draw(0.1, 60.0);
  return options;
}

// The conditions that must bring the force down, written again from the documentation.
bool is_fault(const SafetyInput& in, const SafetyOptions& options) {
  return in.stop || in.late || !(in.dt_s >= 1e-6 && in.dt_s < options.late_s) ||
         in.reading.fault != DeviceFault::kNone || !is_finite(in.wanted_n) ||
         !is_finite(in.velocity_m_per_s) || !is_finite(in.reading.position_m) ||
         (options.dead_man && (in.reading.buttons & options.dead_man_buttons) == 0);
}

TEST(Safety, KeepsItsPromisesWhateverComesIn) {
  int faults_in_force = 0, frames_on = 0;
  std::set<Cause> causes;
  for (uint32_t seed = 1; seed <= 120; ++seed) {
    Chaos chaos(seed);
    GuardedHand hand(options_of(chaos.random));
    hand.label = "seed " + std::to_string(seed);
    const SafetyOptions& options = hand.safety.options();
    double since_fault_s = -1.0;  // < 0: none
    for (int i = 0; i < 4000; ++i) {
      chaos.next(hand.input);
      const double before = hand.newton();
      const bool was_on =
          hand.out.state == SafetyState::kOn || hand.out.state == SafetyState::kRamping;
      hand.step();  // checks finite, magnitude, slew and the states
      causes.insert(hand.out.cause);
      frames_on += hand.out.state == SafetyState::kOn;
      const double dt = hand.input.dt_s >= 1e-6 ? std::min(hand.input.dt_s, 2e-3) : 1e-3;
      if (is_fault(hand.input, options)) {
        // In the frame of the fault: the force falls, or is zero.
        ASSERT_TRUE(hand.newton() < before || hand.newton() == 0.0) << hand.where();
        ASSERT_TRUE(hand.out.state != SafetyState::kOn && hand.out.state != SafetyState::kRamping &&
                    hand.out.state != SafetyState::kWaiting)
            << hand.where();
        if (was_on) {
          since_fault_s = 0.0;
          faults_in_force += before > 0.1;
        }
      }
      if (since_fault_s >= 0.0) {
        since_fault_s += dt;
        if (since_fault_s >= options.off_ramp_s * (1.0 + 1e-9)) {
          ASSERT_EQ(hand.newton(), 0.0) << hand.where();
          since_fault_s = -1.0;
        }
      }
      if (testing::Test::HasFailure()) return;
    }
  }
  // The runs must reach the interesting states: forces were on, faults met them, and the guards
  // acted.
  EXPECT_GT(frames_on, 20000);
  EXPECT_GT(faults_in_force, 500);
  for (Cause cause :
       {Cause::kStarting, Cause::kDeadMan, Cause::kDevice, Cause::kNotFinite, Cause::kLate,
        Cause::kClock, Cause::kTooFast, Cause::kWorkspaceEdge, Cause::kFirstContact,
        Cause::kShaking, Cause::kHot, Cause::kStopped, Cause::kEnergy, Cause::kField})
    EXPECT_TRUE(causes.contains(cause)) << word(cause);
}

TEST(Safety, ComesBackFromAnyGarbage) {
  for (uint32_t seed = 1; seed <= 60; ++seed) {
    Chaos chaos(seed);
    GuardedHand hand(options_of(chaos.random));
    hand.label = "seed " + std::to_string(seed);
    for (int i = 0; i < 3000; ++i) {
      chaos.next(hand.input);
      hand.step();
    }
    hand.input = SafetyInput();
    hand.input.reading.position_m = test::test_device().workspace_centre_m;
    hand.input.reading.fresh = true;
    hand.input.reading.buttons = 3;
    hand.input.rearm = true;
    hand.step();
    hand.input.rearm = false;
    // Cools down, and the energy gate refills.
    hand.steps(30000);
    EXPECT_EQ(hand.out.state, SafetyState::kOn) << seed;
    EXPECT_EQ(hand.out.cause, Cause::kNone) << seed;
    hand.input.wanted_n = {0.1, 0, 0};
    hand.steps(100);
    EXPECT_NEAR(hand.newton(), 0.1, 1e-9) << seed;
  }
}

TEST(Safety, GivesTheSameBitsForTheSameInputs) {
  for (uint32_t seed = 1; seed <= 10; ++seed) {
    Chaos a(seed), b(seed);
    GuardedHand first(options_of(a.random)), second(options_of(b.random));
    for (int i = 0; i < 3000; ++i) {
      a.next(first.input);
      b.next(second.input);
      // A copy has the whole state.
      if (i == 1500) {
        const Safety copy = second.safety;
        second.safety.step(SafetyInput());
        second.safety = copy;
      }
      first.step();
      second.step();
      for (int axis = 0; axis < 3; ++axis)
        ASSERT_EQ(std::bit_cast<uint64_t>(first.out.force_n[axis]),
                  std::bit_cast<uint64_t>(second.out.force_n[axis]))
            << "seed " << seed << " frame " << i;
      ASSERT_EQ(first.out.cause, second.out.cause);
    }
  }
}

}  // namespace
}  // namespace palpate
