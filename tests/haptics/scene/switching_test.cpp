// Changes by a person while the hand is in contact: switches, strengths, stiffness, whole scenes.
// Oracle: a hand that holds still feels no step.
#include <gtest/gtest.h>

#include "tests/haptics/guard/force_steps.h"
#include "tests/haptics/shell_scene.h"

namespace palpate {
namespace {

using namespace test;

constexpr double kSwitchStiffness = 600.0;
// N per ms: the required limit. A hand does not notice a ramp of 20 N/s as an event.
constexpr double kStep_n = 0.02;

/// A hand that has come in from outside and holds still, 2.5 mm deep: 1.5 N.
const glm::dvec3 kHeld(0.018, 0.009, -0.01);

void come_in(Hand& hand, glm::dvec3 at = kHeld) {
  for (int i = 0; i <= 300; ++i) hand.to(at * (1.0 + 0.5 * (1.0 - i / 300.0)));
}

ControlEvent event(ControlEvent::Kind kind, int index, double value) {
  ControlEvent e;
  e.kind = kind;
  e.index = index;
  e.value = value;
  return e;
}

struct Turned {
  double before_n, after_n, worst_step_n;
};

/// Sends one event to a hand that holds still, and waits three seconds.
Turned turn(Hand& hand, const ControlEvent& e) {
  ForceSteps steps;
  for (int i = 0; i < 5; ++i) steps.add(hand.to(kHeld));
  Turned turned{glm::length(steps.last_n()), 0.0, 0.0};
  hand.input.events[0] = e;
  hand.input.event_count = 1;
  for (int i = 0; i < 3000; ++i) steps.add(hand.to(kHeld));
  turned.after_n = glm::length(steps.last_n());
  turned.worst_step_n = steps.worst_n();
  return turned;
}

using Kind = ControlEvent::Kind;

TEST(Switching, OfASurfaceIsARampHoweverStrongItIs) {
  for (const double strength : {2.0, 5.0, 30.0}) {
    Hand hand(shell_spec(strength, 0.3, kSwitchStiffness), {shell(1, 1.0)});
    come_in(hand);
    const Turned off = turn(hand, event(Kind::kModeOn, 0, 0.0));
    EXPECT_GT(off.before_n, 1.0);
    EXPECT_EQ(off.after_n, 0.0);
    EXPECT_LE(off.worst_step_n, kStep_n) << "strength " << strength << " N, off";
    const Turned on = turn(hand, event(Kind::kModeOn, 0, 1.0));
    EXPECT_LE(on.worst_step_n, kStep_n) << "strength " << strength << " N, on";
    // The wall is felt again from the hand's present place.
    ForceSteps deeper;
    for (int i = 0; i < 200; ++i) deeper.add(hand.to(kHeld * (1.0 - 4e-4 * i)));
    EXPECT_GT(glm::length(deeper.last_n()), 0.9);
    std::printf("switching a surface of %.0f N: worst step off %.4f, on %.4f N per ms\n", strength,
                off.worst_step_n, on.worst_step_n);
  }
}

/// A force mode, which pushes everywhere.
SceneSpec pushing() {
  SceneSpec spec = shell_spec(0.0, 0.0, kSwitchStiffness);
  spec.modes[0].kind = "gradient-force";
  spec.modes[0].strength = TransferFunction::constant(3.0);
  spec.modes[0].gain = -1.0;
  return spec;
}

TEST(Switching, OfAForceIsARamp) {
  auto soft = std::make_shared<MovingVolume>(*shell(1, 1.0));
  soft->frames = {std::make_shared<Ball>(0.025, 0.004)};
  Hand hand(pushing(), {soft});
  come_in(hand);
  for (const double value : {0.0, 1.0}) {
    const Turned turned = turn(hand, event(Kind::kModeOn, 0, value));
    EXPECT_NEAR(turned.after_n, 3.0 * value, 1e-9);
    EXPECT_LE(turned.worst_step_n, kStep_n) << "switched to " << value;
  }
  for (const double gain : {0.1, 2.0, 0.0, 1.0}) {
    const Turned turned = turn(hand, event(Kind::kModeGain, 0, gain));
    EXPECT_NEAR(turned.after_n, 3.0 * gain, 1e-9);
    EXPECT_LE(turned.worst_step_n, kStep_n) << "gain to " << gain;
  }
}

TEST(Switching, OfStrengthAndStiffnessIsARamp) {
  Hand hand(shell_spec(6.0, 0.3, kSwitchStiffness), {shell(1, 1.0)});
  come_in(hand);
  for (const double gain : {0.1, 3.0, 1.0}) {
    const Turned turned = turn(hand, event(Kind::kModeGain, 0, gain));
    EXPECT_LE(turned.worst_step_n, kStep_n) << "gain to " << gain;
    EXPECT_LE(turned.after_n, 6.0 * gain + 1e-9);
  }
  come_in(hand);
  for (const double stiffness : {1200.0, 200.0, kSwitchStiffness}) {
    const Turned turned = turn(hand, event(Kind::kStiffness, 0, stiffness));
    EXPECT_NEAR(turned.after_n, stiffness * (0.025 - glm::length(kHeld)), 0.01);
    EXPECT_LE(turned.worst_step_n, kStep_n) << "stiffness to " << stiffness;
  }
}

/// Exchanges the scene while the hand holds still, and waits.
Turned change(Hand& hand, const SceneSpec& spec,
              std::vector<std::shared_ptr<const MovingVolume>> data, int ticks = 2000) {
  ForceSteps steps;
  for (int i = 0; i < 5; ++i) steps.add(hand.to(kHeld));
  Turned turned{glm::length(steps.last_n()), 0.0, 0.0};
  auto scene = plan(spec, std::move(data));
  if (!scene) throw std::runtime_error(scene.error().message);
  hand.haptics.adopt(Haptics::prepare(*scene));
  for (int i = 0; i < ticks; ++i) steps.add(hand.to(kHeld));
  turned.after_n = glm::length(steps.last_n());
  turned.worst_step_n = steps.worst_n();
  return turned;
}

TEST(NewScene, TheSameAgainChangesNothing) {
  Hand hand(shell_spec(6.0, 0.3, kSwitchStiffness), {shell(1, 1.0)});
  come_in(hand);
  const Turned turned = change(hand, shell_spec(6.0, 0.3, kSwitchStiffness), {shell(1, 1.0)});
  EXPECT_LE(turned.worst_step_n, 1e-9);
  EXPECT_NEAR(turned.after_n, turned.before_n, 1e-9);
}

TEST(NewScene, WithModesAddedOrRemovedMakesNoStep) {
  const auto data = shell(1, 1.0);
  const SceneSpec one = shell_spec(6.0, 0.3, kSwitchStiffness);
  SceneSpec none = one;
  none.modes.clear();
  SceneSpec more = one;
  more.modes.push_back(pushing().modes[0]);
  more.modes[1].name = "push";
  more.modes.push_back(one.modes[0]);
  more.modes[2].name = "second wall";
  more.modes.push_back(one.modes[0]);
  more.modes[3].name = "pull";
  more.modes[3].kind = "attractor";
  more.modes[3].strength = TransferFunction::constant(2.0);
  more.modes[3].point_m = {0.0, 0.03, 0.0};
  Hand hand(one, {data});
  come_in(hand);
  EXPECT_LE(change(hand, more, {data}).worst_step_n, kStep_n) << "added";
  EXPECT_LE(change(hand, one, {data}).worst_step_n, kStep_n) << "removed";
  const Turned none_left = change(hand, none, {data});
  EXPECT_LE(none_left.worst_step_n, kStep_n) << "all removed";
  EXPECT_EQ(none_left.after_n, 0.0);
  EXPECT_LE(change(hand, more, {data}).worst_step_n, kStep_n) << "all added";
}

TEST(NewScene, OfOtherDataOrStiffnessMakesNoStep) {
  Hand hand(shell_spec(6.0, 0.3, kSwitchStiffness), {shell(1, 1.0)});
  come_in(hand);
  SceneSpec other = shell_spec(6.0, 0.3, 1500.0);
  auto bigger = std::make_shared<MovingVolume>(*shell(1, 1.0));
  bigger->frames = {std::make_shared<Ball>(0.032, 0.001)};
  auto smaller = std::make_shared<MovingVolume>(*bigger);
  smaller->frames = {std::make_shared<Ball>(0.01, 0.001)};
  for (const auto& data : {bigger, smaller, bigger})
    EXPECT_LE(change(hand, other, {data}).worst_step_n, kStep_n);
  SceneSpec scaled = other;
  scaled.world_from_device.scale = glm::dvec3(2.0);
  scaled.world_from_device.translation_m = {0.01, 0.0, 0.0};
  EXPECT_LE(change(hand, scaled, {smaller}).worst_step_n, kStep_n);
}

TEST(NewScene, ThatIsNoneLetsTheForceFadeAndTheNextOneStartsAtTheHand) {
  Hand hand(shell_spec(6.0, 0.0, kSwitchStiffness), {shell(1, 1.0)});
  come_in(hand);
  ForceSteps steps;
  for (int i = 0; i < 5; ++i) steps.add(hand.to(kHeld));
  EXPECT_GT(glm::length(steps.last_n()), 1.0);
  const auto before = hand.haptics.adopt(nullptr);
  ASSERT_TRUE(before);
  for (int i = 0; i < 1000; ++i) steps.add(hand.to(kHeld));
  EXPECT_EQ(steps.last_n(), glm::dvec3(0.0));
  // By now the hand is somewhere else: no force from the proxy's old place may be left.
  const glm::dvec3 elsewhere(0.0, -0.04, 0.0);
  for (int i = 0; i < 100; ++i) steps.add(hand.to(elsewhere));
  auto scene = plan(shell_spec(6.0, 0.0, kSwitchStiffness), {shell(1, 1.0)});
  hand.haptics.adopt(Haptics::prepare(*scene));
  for (int i = 0; i < 100; ++i) {
    const TickOutput out = hand.to(elsewhere);
    steps.add(out);
    EXPECT_EQ(out.proxy_m, out.probe_m);
  }
  EXPECT_EQ(steps.last_n(), glm::dvec3(0.0));
  EXPECT_LE(steps.worst_n(), kStep_n);
}

TEST(NewScene, InMidBeatMakesNoStepBeyondTheWallsOwn) {
  // Two hands on the same beating heart; the scene of one of them is exchanged again and again.
  const auto data = shell(4, 2.0);
  const SceneSpec spec = shell_spec(20.0, 0.3, kSwitchStiffness);
  Hand calm(spec, {data}), changed(spec, {data});
  const auto scene = plan(spec, {data});
  ASSERT_TRUE(scene);
  double worst = 0.0;
  for (int i = 0; i < 3000; ++i) {
    const double angle = 0.05 * 1e-3 * i / 0.03;
    const glm::dvec3 at =
        (0.028 + 0.004 * std::cos(7e-3 * i)) * glm::dvec3(std::cos(angle), std::sin(angle), 0.0);
    if (i % 77 == 50) changed.haptics.adopt(Haptics::prepare(*scene));
    worst = std::max(worst, glm::length(calm.to(at).wanted_n - changed.to(at).wanted_n));
  }
  std::printf("the same scene again, every 77 ms: %.6f N away from the calm run\n", worst);
  // The closing term of the cycle's last step is computed again, for the material at the proxy at
  // that time: 10 um of a motion field sampled at 1 mm.
  EXPECT_LE(worst, 0.02);
}

TEST(NewScene, KeepsPosesTimesAndSwitchesOfVolumesAndModesByName) {
  const auto data = shell(4, 2.0, Made::kAnalytic, 2.0);
  SceneSpec spec = shell_spec(20.0, 0.0, kSwitchStiffness);
  spec.volumes[0].drive.kind = DriveSpec::Kind::kSecondHand;
  spec.volumes[0].path = PosePath::kExact;
  Hand hand(spec, {data});
  hand.input.poses[0] = {0, {}, 1};
  hand.input.poses[0].transform.translation_m = {0.0, 0.002, 0.0};
  hand.input.pose_count = 1;
  hand.input.events[0] = event(Kind::kModeGain, 0, 0.5);
  hand.input.event_count = 1;
  for (int i = 0; i < 700; ++i) hand.to({0.04, 0.0, 0.0});
  const FramePointer before = hand.to({0.04, 0.0, 0.0}).first;
  for (const PosePath path : {PosePath::kExact, PosePath::kSmooth, PosePath::kPaper}) {
    spec.volumes[0].path = path;
    hand.haptics.adopt(Haptics::prepare(*plan(spec, {data})));
    const TickOutput out = hand.to({0.04, 0.0, 0.0});
    EXPECT_EQ(hand.haptics.run()->volumes[0].offset, glm::dvec3(0.0, 0.002, 0.0)) << int(path);
    EXPECT_EQ(hand.haptics.run()->modes[0].gain, 0.5);
    EXPECT_EQ(out.first.frame, before.frame);
    EXPECT_NEAR(out.first.phase, before.phase, 0.01);
  }
}

/// A ball in two frames, moved by so much in the second one.
std::shared_ptr<MovingVolume> ball_moved_by(glm::dvec3 shift_m,
                                            const std::shared_ptr<const FrameData>& ball) {
  Grid grid;
  grid.size = glm::ivec3(5);
  grid.spacing_mm = glm::dvec3(25.0);
  grid.origin_mm = glm::dvec3(-50.0);
  SequenceMotion motion;
  motion.basis = {{0.0, 0.5}, 1.0, 0};
  motion.terms.assign(2, still_field(grid));
  for (glm::vec3& u_mm : motion.terms[1].u_mm) u_mm = glm::vec3(lps_from_volume(shift_m));
  auto volume = std::make_shared<MovingVolume>();
  volume->times = {motion.basis.times_s, 1.0};
  volume->frames = {ball};
  volume->whole = SequenceMap::of(motion);
  return volume;
}

TEST(NewScene, WithABetterMotionTakesTheHandToItWithoutAStep) {
  const auto ball = std::make_shared<Ball>(0.025, 0.001);
  SceneSpec spec = shell_spec(6.0, 0.0, kSwitchStiffness);
  spec.volumes[0].rate = 0.0;
  const auto coarse = ball_moved_by({}, ball);
  for (const double out_m : {1.5e-3, -1.5e-3}) {
    Hand hand(spec, {coarse});
    hand.input.events[0] = event(Kind::kScrub, 0, 0.5);
    hand.input.event_count = 1;
    come_in(hand);
    ForceSteps steps;
    for (int i = 0; i < 500; ++i) steps.add(hand.to(kHeld));
    const double before_n = glm::length(steps.last_n());
    const auto better = ball_moved_by(out_m * glm::normalize(kHeld), ball);
    ASSERT_TRUE(can_blend(*coarse, *better));
    better->whole_before = coarse->whole;
    hand.haptics.adopt(Haptics::prepare(*plan(spec, {better})));
    steps.add(hand.to(kHeld));
    EXPECT_NEAR(glm::length(steps.last_n()), before_n, 1e-3);
    // A scene that shares the volume goes on where this one is.
    for (int i = 0; i < 200; ++i) steps.add(hand.to(kHeld));
    const double blended = hand.haptics.run()->volumes[0].blended;
    hand.haptics.adopt(Haptics::prepare(*plan(spec, {better})));
    EXPECT_EQ(hand.haptics.run()->volumes[0].blended, blended);
    for (int i = 0; i < 1000; ++i) steps.add(hand.to(kHeld));
    // The wall is felt where it would be without the coarse motion.
    Hand fresh(spec, {ball_moved_by(out_m * glm::normalize(kHeld), ball)});
    fresh.input.events[0] = event(Kind::kScrub, 0, 0.5);
    fresh.input.event_count = 1;
    for (int i = 0; i < 500; ++i) fresh.to(kHeld * 2.0);
    come_in(fresh);
    for (int i = 0; i < 500; ++i) fresh.to(kHeld);
    const double wanted_n = glm::length(fresh.to(kHeld).wanted_n);
    EXPECT_NEAR(wanted_n - before_n, kSwitchStiffness * out_m, 0.15);
    EXPECT_NEAR(glm::length(steps.last_n()), wanted_n, 0.01);
    EXPECT_LE(steps.worst_n(), kStep_n);
    EXPECT_EQ(hand.haptics.run()->volumes[0].blended, 1.0);
  }
  EXPECT_FALSE(can_blend(*coarse, *ball_moved_by({}, std::make_shared<Ball>(0.025, 0.001))));
}

TEST(NewScene, MovesAStillVolumeToWhereTheNewSceneHasIt) {
  const auto data = shell(1, 1.0);
  SceneSpec spec = shell_spec(6.0, 0.0, kSwitchStiffness);
  Hand hand(spec, {data});
  come_in(hand);
  spec.volumes[0].transform.translation_m = {0.004, 0.0, 0.0};
  EXPECT_LE(change(hand, spec, {data}).worst_step_n, kStep_n);
  EXPECT_EQ(hand.haptics.run()->volumes[0].offset, glm::dvec3(0.004, 0.0, 0.0));
}

}  // namespace
}  // namespace palpate
