// The limiters between the scene and the guards (docs/force-limits.md), each acting alone: no other
// limiter has a cause to act, or the limiter is tested without the others. Oracle: its own rate.
// The guards' limiters are tested in the same way in safety_test.cpp and guards_test.cpp.
#include <gtest/gtest.h>

#include "module/haptics/guard/force_bridge.h"
#include "module/haptics/guard/force_rates.h"
#include "tests/haptics/guard/guarded_hand.h"
#include "tests/haptics/shell_scene.h"

namespace palpate {
namespace {

using namespace test;
using Kind = ControlEvent::Kind;

constexpr double kStiffness = 600.0;
constexpr double kTick_s = 1e-3;
constexpr double kRounding_n = 1e-9;
// The proxy does not correct moves of less than 0.5 um: 0.0003 N of the spring.
constexpr double kProxy_n = 5e-4;

/// The hand comes in from outside to a depth of `deep_m` below the ball's surface. Nothing else
/// changes.
double lean(Hand& hand, double deep_m) {
  double force_n = 0.0;
  for (int i = 0; i <= 300; ++i)
    force_n = glm::length(hand.to({0.026 - (0.001 + deep_m) * i / 300.0, 0.0, 0.0}).wanted_n);
  return force_n;
}

/// The force one tick later on a hand that stays at this depth.
double next_n(Hand& hand, double deep_m) {
  return glm::length(hand.to({0.025 - deep_m, 0.0, 0.0}).wanted_n);
}

void send(Hand& hand, Kind kind, double value) {
  ControlEvent event;
  event.kind = kind;
  event.value = value;
  hand.input.events[0] = event;
  hand.input.event_count = 1;
}

// ---- Ramp

TEST(ForceLimits, RampOwnsASwitchedMode) {
  Hand hand(shell_spec(5.0, 0.0, kStiffness), {shell(1, 1.0)});
  const double before = lean(hand, 0.0025);
  ASSERT_NEAR(before, 1.5, 0.01);
  send(hand, Kind::kModeOn, 0.0);
  for (int ms = 1; ms <= 100; ++ms)
    ASSERT_NEAR(next_n(hand, 0.0025), before - kRamp_n_per_s * kTick_s * ms, kProxy_n) << ms;
}

TEST(ForceLimits, RampOwnsAChangedGain) {
  Hand hand(shell_spec(5.0, 0.0, kStiffness), {shell(1, 1.0)});
  const double before = lean(hand, 0.0025);
  send(hand, Kind::kModeGain, 0.1);
  for (int ms = 1; ms <= 80; ++ms)
    ASSERT_NEAR(next_n(hand, 0.0025), before - kRamp_n_per_s * kTick_s * ms, kProxy_n) << ms;
  for (int ms = 81; ms <= 200; ++ms) next_n(hand, 0.0025);
  EXPECT_NEAR(next_n(hand, 0.0025), 0.5, kProxy_n);
}

TEST(ForceLimits, RampOwnsAChangedStiffness) {
  for (const double wanted : {200.0, 1200.0}) {
    Hand hand(shell_spec(20.0, 0.0, kStiffness), {shell(1, 1.0)});
    const double before = lean(hand, 0.005);
    ASSERT_NEAR(before, 3.0, 0.01);
    send(hand, Kind::kStiffness, wanted);
    const double step = std::copysign(kRamp_n_per_s * kTick_s, wanted - kStiffness);
    for (int ms = 1; ms <= 40; ++ms)
      ASSERT_NEAR(next_n(hand, 0.005), before + step * ms, kProxy_n) << wanted << " N/m, " << ms;
  }
}

TEST(ForceLimits, RampOwnsAllThatIsTurnedAtOnce) {
  Hand hand(shell_spec(5.0, 0.0, kStiffness), {shell(1, 1.0)});
  double before = lean(hand, 0.0025);
  const std::pair<Kind, double> turned[] = {
      {Kind::kModeOn, 0.0}, {Kind::kModeGain, 0.5}, {Kind::kStiffness, 300.0}};
  for (const auto& [kind, value] : turned) {
    ControlEvent& event = hand.input.events[size_t(hand.input.event_count++)];
    event.kind = kind;
    event.value = value;
  }
  for (int ms = 1; ms <= 400; ++ms) {
    const double now = next_n(hand, 0.0025);
    ASSERT_LE(std::abs(now - before), kRamp_n_per_s * kTick_s + kProxy_n) << ms;
    before = now;
  }
  EXPECT_NEAR(before, 0.0, kProxy_n);
}

TEST(ForceLimits, DeviceBoundsTheStiffness) {
  const SceneSpec spec = shell_spec(20.0, 0.0, kStiffness);
  const auto scene = plan(spec, {shell(1, 1.0)});
  ASSERT_TRUE(scene);
  DeviceInfo weak = Hand::device();
  weak.max_stiffness_n_per_m = 300.0;
  Hand hand(spec, {shell(1, 1.0)});
  hand.haptics = Haptics(unmetered(), weak);
  hand.haptics.adopt(Haptics::prepare(*scene));
  EXPECT_NEAR(lean(hand, 0.0025), 300.0 * 0.0025, kProxy_n);
  SceneSpec larger = spec;
  larger.world_from_device.scale = {1.0, 2.0, 1.0};
  EXPECT_EQ(hand.haptics.stiffness_on_device(**plan(larger, {shell(1, 1.0)}), kStiffness), 150.0);
}

// ---- Confidence

TEST(ForceLimits, ConfidenceWeakensWhatTheFieldCarries) {
  const auto still = [](float confidence) {
    auto volume = std::make_shared<MovingVolume>(*shell(1, 1.0));
    volume->frames.push_back(volume->frames[0]);
    volume->times.times_s = {0.0, 100.0};
    const Grid grid = shell_grid(8.0);
    const Confidence everywhere{grid, std::vector<float>(grid.count(), confidence)};
    const Field field{grid, std::vector<glm::vec3>(grid.count())};
    volume->motions = {{"data", {MotionMap::of(field, &everywhere)}}};
    return volume;
  };
  // A smooth step from 0 at 0.1 to 1 at 0.35: at 0.2 it is 0.4^2 (3 - 2 0.4) of 5 N.
  for (const auto& [confidence, most_n] :
       {std::pair{0.05F, 0.0}, {0.2F, 0.352 * 5.0}, {0.9F, kStiffness * 0.004}}) {
    SceneSpec spec = shell_spec(5.0, 0.0, kStiffness);
    spec.volumes[0].cyclic = false;
    Hand hand(spec, {still(confidence)});
    EXPECT_NEAR(lean(hand, 0.004), most_n, 0.005) << confidence;
  }
}

// ---- Fade

/// A carrier that finds its point, or loses it, as the test sets it.
class ToldCarrier final : public Carrier {
 public:
  void carry() noexcept override {}
  bool go_to(glm::dvec3 world) noexcept override {
    if (!is_lost) at_ = world;
    return !is_lost;
  }
  void place(const SceneMode&, glm::dvec3, double, double, double, Placed&) noexcept override {}
  void set_rough() { report_.rough = true; }
  bool is_lost = false;
};

TEST(ForceLimits, FadeOwnsALostPoint) {
  // A large force falls at its rate, a small one in 20 ms.
  for (const double felt_n : {2.0, 0.5}) {
    const int whole_ms = std::max(20, int(std::lround(felt_n / kFade_n_per_s / kTick_s)));
    CarrierRun run;
    auto owned = std::make_unique<ToldCarrier>();
    ToldCarrier& carrier = *owned;
    run.carrier = std::move(owned);
    carrier.is_lost = true;
    for (int ms = 1; ms <= whole_ms; ++ms) {
      run.follow_to({1.0, 0.0, 0.0}, felt_n, kTick_s);
      // The limit on the force of the carrier's modes: cap_n * fade.
      ASSERT_NEAR(run.cap_n * run.fade, felt_n * (1.0 - double(ms) / whole_ms), kRounding_n) << ms;
    }
    carrier.is_lost = false;
    // As at the beginning of the next frame.
    run.frozen = false;
    for (int ms = 1; ms < whole_ms; ++ms) {
      run.follow_to({1.0, 0.0, 0.0}, 0.0, kTick_s);
      ASSERT_NEAR(run.cap_n * run.fade, felt_n * ms / whole_ms, kRounding_n) << ms;
    }
    for (int ms = 0; ms < 2; ++ms) run.follow_to({1.0, 0.0, 0.0}, 0.0, kTick_s);
    EXPECT_EQ(run.fade, 1.0);
    EXPECT_EQ(run.cap_n, std::numeric_limits<double>::infinity());
  }
}

// ---- Tank

TEST(ForceLimits, TankOwnsWhatTheScenePushes) {
  SceneSpec spec = shell_spec(20.0, 0.0, kStiffness);
  spec.volumes[0].drive.kind = DriveSpec::Kind::kSwing;
  spec.volumes[0].drive.axis = {1.0, 0.0, 0.0};
  spec.volumes[0].drive.rate_hz = 0.5;
  spec.volumes[0].drive.amplitude_m = 0.003;
  spec.volumes[0].path = PosePath::kExact;
  HapticsOptions empty = unmetered();
  empty.meter_energy = true;
  empty.tank = {0.0, 0.0, 0.0};
  for (const bool metered : {false, true}) {
    Hand hand(spec, {shell(1, 1.0)}, metered ? empty : unmetered());
    double force_n = 0.0;
    // The ball moves 2.8 mm over a hand that stands still.
    for (int ms = 0; ms < 500; ++ms) force_n = glm::length(hand.to({0.0252, 0.0, 0.0}).wanted_n);
    EXPECT_NEAR(force_n, metered ? 0.0 : kStiffness * 0.0028, 0.01);
    EXPECT_EQ(hand.haptics.tank().ledger().slips > 100, metered);
  }
}

// ---- Bridge

TEST(ForceLimits, BridgeOwnsAnotherScene) {
  const SceneSpec spec = shell_spec(5.0, 0.0, kStiffness);
  SceneSpec none = spec;
  none.modes.clear();
  Hand hand(spec, {shell(1, 1.0)});
  const double before = lean(hand, 0.0025);
  hand.haptics.adopt(Haptics::prepare(*plan(none, {shell(1, 1.0)})));
  for (int ms = 1; ms <= 99; ++ms)
    ASSERT_NEAR(next_n(hand, 0.0025), before - kExchange_n_per_s * kTick_s * ms, kRounding_n) << ms;
  for (int ms = 100; ms <= 102; ++ms) next_n(hand, 0.0025);
  EXPECT_EQ(next_n(hand, 0.0025), 0.0);
}

TEST(ForceLimits, BridgeLeadsToAnotherSceneAtItsOwnRateAlsoAfterASuddenChange) {
  ForceBridge bridge;
  ForceBridge::BridgeFrame frame;
  frame.stiffness_n_per_m = kStiffness;
  frame.dt_s = kTick_s;
  frame.felt_n = {1.0, 0.0, 0.0};
  const glm::dvec3 sudden = bridge.step(frame, nullptr);
  ASSERT_TRUE(bridge.is_sudden());
  ASSERT_NEAR(sudden.x, 1.0 - kSudden_n_per_s * kTick_s, kRounding_n);
  bridge.exchange(sudden, glm::dvec3(0.0));
  frame.felt_n = sudden;
  EXPECT_NEAR(bridge.step(frame, nullptr).x, sudden.x - kExchange_n_per_s * kTick_s, kRounding_n);
  EXPECT_FALSE(bridge.is_sudden());
}

TEST(ForceLimits, BridgeOwnsASceneThatIsTakenAway) {
  Hand hand(shell_spec(5.0, 0.0, kStiffness), {shell(1, 1.0)});
  const double before = lean(hand, 0.0025);
  ASSERT_TRUE(hand.haptics.adopt(nullptr));
  for (int ms = 1; ms <= 99; ++ms)
    ASSERT_NEAR(next_n(hand, 0.0025), before - kExchange_n_per_s * kTick_s * ms, kRounding_n) << ms;
}

TEST(ForceLimits, BridgeOwnsWhatTheSceneChangesAtOnce) {
  auto volume = std::make_shared<MovingVolume>(*shell(1, 1.0));
  // The ball is gone after 2.5 s; nothing moves.
  volume->frames = {volume->frames[0], std::make_shared<Ball>(0.001, 1.06e-3),
                    std::make_shared<Ball>(0.001, 1.06e-3)};
  volume->times.times_s = {0.0, 2.5, 5.0};
  SceneSpec spec = shell_spec(5.0, 0.0, kStiffness);
  spec.volumes[0].cyclic = spec.volumes[0].blend_values = false;
  Hand hand(spec, {volume});
  // Until the start ramp of the guards has ended: from then on the reported cause is the scene's.
  for (int ms = 0; ms < 2100; ++ms) hand.to({0.03, 0.0, 0.0});
  const double before = lean(hand, 0.0025);
  ASSERT_NEAR(before, 1.5, 0.01);
  TickOutput out;
  int ms = 2401;
  do out = hand.to({0.0225, 0.0, 0.0});
  while (++ms < 2600 && out.first.frame == 0);
  for (int fall = 1; fall < 49; ++fall) {
    ASSERT_NEAR(glm::length(out.wanted_n), before - kSudden_n_per_s * kTick_s * fall, kProxy_n)
        << fall;
    ASSERT_EQ(out.cause, glm::length(out.wanted_n) > 0.05 ? Cause::kSudden : Cause::kNone);
    out = hand.to({0.0225, 0.0, 0.0});
  }
}

ForceBridge::BridgeFrame frame_of(double spring_n, double felt_n, double step_m) {
  ForceBridge::BridgeFrame frame;
  frame.spring_n = {spring_n, 0.0, 0.0};
  frame.felt_n = {felt_n, 0.0, 0.0};
  frame.step_m = frame.worked_m = {step_m, 0.0, 0.0};
  frame.stiffness_n_per_m = kStiffness;
  frame.dt_s = kTick_s;
  return frame;
}

TEST(ForceLimits, BridgeGoesFasterWhereTheMotionMayNotBeInverted) {
  for (const bool rough : {false, true}) {
    const std::array<ForceBridge::MaterialStep, 1> materials{{{{}, rough}}};
    ForceBridge bridge;
    ForceBridge::BridgeFrame frame = frame_of(0.0, 2.0, 0.0);
    frame.materials = materials;
    const double rate = rough ? kFade_n_per_s : kSudden_n_per_s;
    EXPECT_NEAR(bridge.step(frame, nullptr).x, 2.0 - rate * kTick_s, kRounding_n);
    EXPECT_EQ(bridge.is_rough(), rough);
  }
}

TEST(ForceLimits, BridgeLetsTheHandsOwnWayThrough) {
  // 0.2 mm into a wall in one tick: 0.12 N more passes at once, and half as much again for the
  // curvature of the wall.
  ForceBridge bridge;
  EXPECT_NEAR(bridge.step(frame_of(1.12, 1.0, -0.2e-3), nullptr).x, 0.0, kRounding_n);
  // A further step of 1 N, which the hand's motion does not explain, in the same tick.
  EXPECT_NEAR(bridge.step(frame_of(2.12, 1.0, -0.2e-3), nullptr).x, -0.97 + 0.03, kRounding_n);
}

TEST(ForceLimits, TankOwnsABridgeThatPushesTheHandOn) {
  for (const double step_m : {1e-4, -1e-4}) {
    for (const bool is_empty : {false, true}) {
      ForceBridge bridge;
      bridge.exchange({2.0, 0.0, 0.0}, {0.0, 0.0, 0.0});
      EnergyTank tank(is_empty ? EnergyTankOptions{0.0, 0.0, 0.0} : EnergyTankOptions{});
      const glm::dvec3 left = bridge.step(frame_of(0.0, 2.0, step_m), &tank);
      const bool is_cut = is_empty && step_m > 0.0;
      EXPECT_NEAR(left.x, is_cut ? 0.0 : 2.0 - kExchange_n_per_s * kTick_s, kRounding_n);
    }
  }
}

// ---- The guards: what safety_test.cpp does not show alone

TEST(ForceLimits, ReturnOwnsWhatAYoungContactHeldBack) {
  GuardedHand hand;
  hand.start();
  hand.input.touching = true;
  hand.input.stiffness_n_per_m = kStiffness;
  const auto move = [&hand](double step_m) {
    hand.input.reading.position_m.x -= step_m;
    hand.input.wanted_n.x += kStiffness * step_m;
    hand.step();
  };
  // 5 mm in, to 3 N, of which 2 N come in time because the contact is new.
  constexpr double kIn_m = 0.5e-3, kOut_m = 0.1e-3;
  double put_in_j = 0.0, returned_j = 0.0;
  for (int ms = 1; ms <= 10; ++ms) {
    put_in_j += hand.newton() * kIn_m;
    move(kIn_m);
  }
  ASSERT_NEAR(hand.newton(), 2.0, kRounding_n);
  ASSERT_EQ(hand.out.cause, Cause::kFirstContact);
  // Out again. The slew alone would let the force rise to the spring's, which returns 7.5 mJ.
  for (int ms = 1; ms <= 50; ++ms) {
    returned_j += hand.newton() * kOut_m;
    move(-kOut_m);
    // At the end nothing is owed any more.
    if (ms > 45) continue;
    EXPECT_LT(hand.newton(), 0.8 * hand.input.wanted_n.x) << ms;
    EXPECT_EQ(hand.out.cause, Cause::kReturn) << ms;
  }
  // What sampling makes is not owed: the force is constant while the hand moves on.
  const double sampled_j = 0.5 * kStiffness * (10 * kIn_m * kIn_m + 50 * kOut_m * kOut_m);
  EXPECT_LE(returned_j, put_in_j + sampled_j);
  EXPECT_GT(returned_j, 0.9 * put_in_j);
}

TEST(ForceLimits, BuzzOwnsAForceThatHums) {
  GuardedHand hand;
  hand.start();
  // The peak of each 25 ms: two waves of 80 Hz.
  std::vector<double> peaks_n;
  for (int ms = 0; ms < 2000; ms += 25) {
    peaks_n.push_back(0.0);
    for (int i = ms; i < ms + 25; ++i) {
      hand.input.wanted_n = {1.75 * std::sin(0.16 * std::numbers::pi * i), 0.0, 0.0};
      hand.step();
      peaks_n.back() = std::max(peaks_n.back(), hand.newton());
    }
    if (peaks_n.back() < 0.21 * 1.75) break;
  }
  EXPECT_GT(peaks_n.front(), 1.7);
  // The guard may trip only when a fifth of the gain is left.
  EXPECT_LT(peaks_n.back(), 0.21 * 1.75);
  EXPECT_EQ(hand.out.state, SafetyState::kOn);
  EXPECT_EQ(hand.out.cause, Cause::kShaking);  // the hand rests: the scene shakes
}

}  // namespace
}  // namespace palpate
