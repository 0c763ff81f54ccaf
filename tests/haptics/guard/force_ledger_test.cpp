// Where the newtons of a haptic frame went: in random scenes with random hands and faults the
// spring's force minus all that the limiters hold back is the force that is given, in every tick.
#include "module/haptics/force_ledger.h"

#include <gtest/gtest.h>

#include <set>

#include "module/haptics/force_vector.h"
#include "tests/haptics/shell_scene.h"
#include "tests/support/random.h"

namespace palpate {
namespace {

using namespace test;
using Kind = ControlEvent::Kind;

constexpr double kMost_n = 1e-9, kTwoPi = 6.283185307179586;

/// A device that states what its motors hold for ever, so that they can become hot.
DeviceInfo ledger_device() {
  DeviceInfo device = Hand::device();
  device.max_force_n = 6.0;
  device.continuous_force_n = 1.0;
  device.workspace_radius_m = 0.04;  // the hand comes to its edge
  return device;
}

HapticsOptions ledger_options(Random& random) {
  HapticsOptions options;
  options.lead = random.draw(0.0, 1.0) < 0.5;
  options.tank = {random.draw(0.0, 0.002), random.draw(0.0, 0.02), 0.5};
  options.safety.start_ramp_s = random.draw(0.01, 0.3);
  options.safety.thermal_s = 0.2;
  options.safety.max_power_w = random.draw(0.02, 2.0);
  options.safety.burst_j = random.draw(0.001, 0.5);
  options.safety.max_slew_n_per_s = random.draw(100.0, 2000.0);
  options.safety.max_speed_m_per_s = random.draw(0.2, 1.5);
  return options;
}

std::unique_ptr<HapticRun> ledger_scene(Random& random) {
  const bool beats = random.draw(0.0, 1.0) < 0.7;
  SceneSpec spec =
      shell_spec(random.draw(2.0, 20.0), random.draw(0.0, 0.5), random.draw(200, 2000));
  spec.world_from_device.rotation =
      glm::normalize(glm::dquat(1.0, random.draw(-1, 1), random.draw(-1, 1), random.draw(-1, 1)));
  if (random.draw(0.0, 1.0) < 0.5) {
    spec.volumes[0].drive.kind = DriveSpec::Kind::kSwing;
    spec.volumes[0].drive.axis = {1.0, 0.0, 0.0};
    spec.volumes[0].drive.rate_hz = random.draw(0.5, 3.0);
    spec.volumes[0].drive.amplitude_m = random.draw(0.0, 0.006);
    spec.volumes[0].path = PosePath::kExact;
  }
  spec.tool_points = int(random.draw(1.0, kMostToolPoints + 0.999));
  spec.tool_radius_m = spec.tool_points > 1 || random.draw(0.0, 1.0) < 0.3 ? 0.004 : 0.0;
  static const auto kBeats = shell(6, 12.0), kStill = shell(1, 1.0);
  return Haptics::prepare(*plan(spec, {beats ? kBeats : kStill}));
}

TEST(ForceLedger, ExplainsEveryNewtonOfRandomScenesHandsAndFaults) {
  std::set<Limiter> acted;
  int touching = 0;
  for (uint32_t seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    const auto one_in = [&](double n) { return random.draw(0.0, n) < 1.0; };
    const DeviceInfo device = ledger_device();
    Haptics haptics(ledger_options(random), device);
    haptics.adopt(ledger_scene(random));
    TickInput input;
    // A grip of 0.1 kg that the scene's force pushes back, led to places in and about the ball.
    glm::dvec3 x_m{0.0, 0.0, 0.06}, speed{0.0}, target_m = x_m;
    double lead_n_per_m = 300.0;
    int shaken_ms = 0;  // how long the hand still trembles, so that the force buzzes
    for (int ms = 0; ms < 4000; ++ms) {
      if (one_in(250.0)) {
        target_m = random.vector(0.035);
        lead_n_per_m = random.draw(50.0, 3000.0);
      }
      if (one_in(1500.0)) shaken_ms = 600;
      if (ms < 500) target_m = {0.0, 0.0, 0.06};
      if (one_in(1200.0)) haptics.adopt(one_in(4.0) ? nullptr : ledger_scene(random));
      input.event_count = 0;
      if (one_in(400.0)) {
        constexpr Kind kKinds[] = {Kind::kModeOn, Kind::kModeGain, Kind::kStiffness,
                                   Kind::kRearm,  Kind::kRate,     Kind::kStop};
        ControlEvent& event = input.events[size_t(input.event_count++)];
        event.kind = kKinds[size_t(random.draw(0.0, one_in(5.0) ? 6.0 : 5.0))];
        event.value =
            event.kind == Kind::kStiffness ? random.draw(100.0, 3000.0) : random.draw(0.0, 2.0);
      }
      input.dt_s = one_in(300.0) ? random.draw(0.0, 0.02) : 1e-3;
      input.late = one_in(2000.0);
      input.now_ns += std::llround(1e9 * input.dt_s);
      input.reading.fault = one_in(3000.0) ? DeviceFault::kTimeout : DeviceFault::kNone;
      input.reading.fresh = !one_in(20.0);
      const double tremor_m = --shaken_ms > 0 ? 0.002 * std::sin(0.08 * kTwoPi * ms) : 0.0;
      input.reading.position_m =
          one_in(3000.0) ? glm::dvec3(std::nan("")) : x_m + glm::dvec3(tremor_m);
      input.reading.time_ns = input.now_ns;
      input.reading.grip.turns = !one_in(50.0);
      input.reading.grip.device_from_grip =
          glm::angleAxis(std::sin(3e-3 * ms), glm::dvec3(0.6, 0.0, 0.8));

      const TickOutput out = haptics.tick(input);
      const std::string where = "seed " + std::to_string(seed) + ", tick " + std::to_string(ms);
      ASSERT_LT(length_of(out.ledger.left_n() - out.command.force_n), kMost_n) << where;
      // Of a scene that only has a spring, asked_n is that spring, less what the tank refused.
      if (haptics.run() && is_finite(out.wanted_n)) {
        const glm::dvec3 spring_n = haptics.run()->stiffness_n_per_m * (out.proxy_m - out.probe_m);
        const glm::dquat& device_to_world = haptics.run()->scene->world_from_device.rotation;
        const glm::dvec3 asked_n = out.ledger.asked_n - out.ledger[Limiter::kTank];
        ASSERT_LT(glm::distance(device_to_world * asked_n, spring_n), kMost_n) << where;
      }
      for (size_t k = 0; k < kLimiters; ++k)
        if (glm::length(out.ledger.held_n[k]) > 0.005) acted.insert(Limiter(k));
      touching += out.command.in_contact;

      const glm::dvec3 push_n = out.command.force_n + lead_n_per_m * (target_m - x_m) - 8.0 * speed;
      speed += push_n / 0.1 * 1e-3;
      x_m += speed * 1e-3;
    }
  }
  EXPECT_GT(touching, 10'000);
  for (size_t k = 0; k < kLimiters; ++k)
    if (Limiter(k) != Limiter::kFinite) {
      EXPECT_TRUE(acted.count(Limiter(k))) << word(Limiter(k)) << " never acted";
    }
}

TEST(ForceLedger, HasAWordAndASentenceForEachLimiter) {
  std::set<std::string> words, sentences;
  for (size_t k = 0; k < kLimiters; ++k) {
    words.insert(word(Limiter(k)));
    sentences.insert(sentence(Limiter(k)));
    EXPECT_EQ(std::string(sentence(Limiter(k))).back(), '.');
  }
  EXPECT_EQ(words.size(), kLimiters);
  EXPECT_EQ(sentences.size(), kLimiters);
  EXPECT_FALSE(words.count("unknown"));
}

}  // namespace
}  // namespace palpate
