// The beating shell in every kind of playback, several volumes, several motions of one volume.
// Oracle: the shell's radius in closed form at the frame pointer, and Coulomb's law.
#include <gtest/gtest.h>

#include "compute/volume/phantom.h"
#include "module/scene/make_volume.h"
#include "tests/haptics/guard/force_steps.h"
#include "tests/haptics/shell_scene.h"

namespace palpate {
namespace {

using namespace test;

constexpr double kStiffness = 600.0;
constexpr int kFrames = 4;
// Contact is found to 0.2 um. A motion field sampled at 1 mm has an error of 3 um between samples,
// which a proxy in contact adds up over the four steps of a beat.
constexpr double kMethod_n = 0.01;

ControlEvent event(ControlEvent::Kind kind, double value) {
  ControlEvent e;
  e.kind = kind;
  e.value = value;
  return e;
}

using Radius = double (*)(FramePointer at, int frames);

/// A hand that presses on the beating wall, and the largest error of its force.
class Pressing {
 public:
  explicit Pressing(const SceneSpec& spec, std::shared_ptr<const MovingVolume> data,
                    Radius radius_m = shell_radius_m)
      : hand_(spec, {std::move(data)}), radius_m_(radius_m) {}
  void go(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      const double r = 0.0285 + 0.004 * std::cos(0.02 * double(tick_++));
      const glm::dvec3 dir = glm::normalize(glm::dvec3(0.6, 0.5, -0.4));
      const TickOutput out = hand_.to(r * dir);
      const double wall = radius_m_(out.first, kFrames);
      const double exact = kStiffness * std::max(0.0, wall - r);
      worst_n = std::max(worst_n, glm::length(out.wanted_n - exact * dir));
      // The force step minus the motion of hand and wall in this tick: the remainder must be small.
      const double moved = std::abs(wall - last_wall_) + std::abs(r - last_r_);
      if (known_)
        worst_step_n =
            std::max(worst_step_n, glm::length(out.wanted_n - last_n_) - kStiffness * moved);
      last_wall_ = wall;
      last_r_ = r;
      last_n_ = out.wanted_n;
      known_ = true;
      touched += exact > 0.0;
      held |= out.frozen;
      last = out.first;
    }
  }
  void send(const ControlEvent& e) {
    hand_.input.events[0] = e;
    hand_.input.event_count = 1;
  }
  double worst_n = 0.0, worst_step_n = 0.0;
  int touched = 0;
  bool held = false;
  FramePointer last;

 private:
  Hand hand_;
  Radius radius_m_;
  int tick_ = 0;
  double last_wall_ = 0.0, last_r_ = 0.0;
  glm::dvec3 last_n_{0.0};
  bool known_ = false;
};

TEST(Playing, GivesTheExactForceAtEveryRateForwardsAndBackwards) {
  const auto data = shell(kFrames, 1.0);
  for (const double rate : {0.1, 1.0, 7.0, 30.0, 100.0, -0.1, -1.0, -30.0, -100.0}) {
    SceneSpec spec = shell_spec(50.0, 0.0, kStiffness);
    spec.volumes[0].rate = rate;
    Pressing hand(spec, data);
    hand.go(3000);
    std::printf("%.1f frames/s: worst error %.4f N, worst step beyond hand and wall %.4f N\n", rate,
                hand.worst_n, hand.worst_step_n);
    EXPECT_LE(hand.worst_n, kMethod_n) << rate << " frames per second";
    EXPECT_GT(hand.touched, 500);
    EXPECT_FALSE(hand.held);
  }
}

/// The same shell as one frame's values carried by one motion for all times.
std::shared_ptr<const MovingVolume> carried_shell(double frames_per_second, size_t reference) {
  const auto own = shell(kFrames, frames_per_second);
  SequenceMotion motion;
  motion.reference = reference;
  motion.basis = {own->times.times_s, own->times.cycle_s, 0};
  for (int k = 0; k < kFrames; ++k)
    motion.terms.push_back(shell_truth(shell_grid(1.0), int(reference), k, kFrames));
  return std::make_shared<const MovingVolume>(*carried(*own, motion));
}

/// The exact radius where one motion carries the shell, m. Between frames at equal intervals: the
/// cubic whose slope at a frame is half the difference of its neighbours (Catmull and Rom 1974).
double carried_radius_m(FramePointer at, int n) {
  const auto r = [&](int k) { return 1e-3 * shell_radius_mm((at.frame + k + n) % n, n); };
  const double s = at.phase;
  return r(0) + 0.5 * s * (r(1) - r(-1)) + s * s * (r(-1) - 2.5 * r(0) + 2.0 * r(1) - 0.5 * r(2)) +
         0.5 * s * s * s * (3.0 * (r(0) - r(1)) + r(2) - r(-1));
}

TEST(OneMotionForAllTimes, GivesTheExactForceAtEveryRateForwardsAndBackwards) {
  for (const size_t reference : {size_t(0), size_t(1), size_t(2)}) {
    const auto data = carried_shell(1.0, reference);
    for (const double rate : {0.1, 1.0, 7.0, 30.0, -1.0, -100.0}) {
      SceneSpec spec = shell_spec(50.0, 0.0, kStiffness);
      spec.volumes[0].rate = rate;
      Pressing hand(spec, data, carried_radius_m);
      hand.go(3000);
      std::printf("%.1f frames/s: worst error %.4f N, worst step beyond hand and wall %.4f N\n",
                  rate, hand.worst_n, hand.worst_step_n);
      EXPECT_LE(hand.worst_n, 0.2 * kMethod_n)
          << rate << " frames per second, from frame " << reference;
      EXPECT_GT(hand.touched, 500);
      EXPECT_FALSE(hand.held);
    }
  }
}

TEST(OneMotionForAllTimes, TakesTheHandOverFromStepsWithoutAJump) {
  // The one motion arrives while the steps are felt, and the scene is exchanged in contact: at a
  // frame, where both put the wall at the same place, and between two frames, where straight lines
  // and curves are 0.7 mm apart. There the hand stays with the material on which it rests.
  for (const int exchange : {2000, 1500}) {
    const SceneSpec spec = shell_spec(50.0, 0.0, kStiffness);
    Hand hand(spec, {shell(kFrames, 1.0)});
    const glm::dvec3 dir = glm::normalize(glm::dvec3(0.6, 0.5, -0.4));
    double worst_n = 0.0;
    glm::dvec3 last_n(0.0);
    for (int i = 0; i < 3000; ++i) {
      if (i == exchange) {
        auto scene = plan(spec, {carried_shell(1.0, 1)});
        ASSERT_TRUE(scene);
        hand.haptics.adopt(Haptics::prepare(*scene));
      }
      const TickOutput out = hand.to(0.0285 * dir);
      if (i > 10) worst_n = std::max(worst_n, glm::length(out.wanted_n - last_n));
      last_n = out.wanted_n;
      if (i >= exchange && exchange == 1500) continue;
      const Radius radius_m = i < exchange ? shell_radius_m : carried_radius_m;
      const double exact = kStiffness * std::max(0.0, radius_m(out.first, kFrames) - 0.0285);
      EXPECT_NEAR(glm::length(out.wanted_n), exact, kMethod_n) << "tick " << i;
    }
    EXPECT_LE(worst_n, 0.03) << "exchanged at tick " << exchange;
  }
}

TEST(Playing, PausesScrubsAndReversesWithoutLeavingTheExactForce) {
  const auto data = shell(kFrames, 4.0);
  Pressing hand(shell_spec(50.0, 0.0, kStiffness), data);
  using Kind = ControlEvent::Kind;
  hand.go(300);
  hand.send(event(Kind::kRate, 0.0));
  hand.go(200);
  const FramePointer paused = hand.last;
  hand.go(100);
  EXPECT_EQ(hand.last.frame, paused.frame);
  EXPECT_EQ(hand.last.phase, paused.phase);
  for (const double value : {0.9, 0.05, 0.5, -0.2, 7.3, 0.25}) {
    hand.send(event(Kind::kScrub, value));
    hand.go(400);
  }
  for (const double rate : {-1.0, 2.0, -25.0, 25.0, 0.0, 1.0}) {
    hand.send(event(Kind::kRate, rate));
    hand.go(250);
  }
  std::printf("pause, scrub, reverse: worst error %.4f N, worst step beyond %.4f N\n", hand.worst_n,
              hand.worst_step_n);
  EXPECT_LE(hand.worst_n, kMethod_n);
  EXPECT_LE(hand.worst_step_n, 0.02);
  EXPECT_FALSE(hand.held);
}

TEST(Playing, HonoursFramesOfUnevenLengths) {
  auto data = std::make_shared<MovingVolume>(*shell(kFrames, 1.0));
  data->times.times_s = {0.0, 0.02, 0.9, 1.0};
  data->times.cycle_s = 1.05;
  Pressing hand(shell_spec(50.0, 0.0, kStiffness), data);
  hand.go(5000);
  std::printf("uneven frames: worst error %.4f N\n", hand.worst_n);
  EXPECT_LE(hand.worst_n, kMethod_n);
  EXPECT_FALSE(hand.held);
}

TEST(Playing, RestsInTheLastFrameOfWhatDoesNotRepeat) {
  auto data = std::make_shared<MovingVolume>(*shell(kFrames, 4.0));
  data->times.cycle_s = 0.0;
  data->motions[0].steps.pop_back();
  Pressing hand(shell_spec(50.0, 0.0, kStiffness), data);
  hand.go(2000);
  EXPECT_EQ(hand.last.frame, kFrames - 1);
  EXPECT_EQ(hand.last.phase, 0.0);
  EXPECT_LE(hand.worst_n, kMethod_n);
  hand.send(event(ControlEvent::Kind::kRate, -1.0));
  hand.go(2000);
  EXPECT_EQ(hand.last.frame, 0);
  EXPECT_LE(hand.worst_n, kMethod_n);
}

TEST(SeveralVolumes, AreFeltTogether) {
  // A still ball and a beating one about the same centre: the proxy stays on the larger one.
  auto still = std::make_shared<MovingVolume>(*shell(1, 1.0));
  still->frames = {std::make_shared<Ball>(0.0285, 1.06e-3)};
  SceneSpec spec = shell_spec(50.0, 0.0, kStiffness);
  spec.volumes.push_back(spec.volumes[0]);
  spec.volumes[1].name = "still";
  spec.modes.push_back(spec.modes[0]);
  spec.modes[1].name = "still wall";
  spec.modes[1].volume = "still";
  Hand hand(spec, {shell(kFrames, 2.0), still});
  double worst = 0.0;
  int of_still = 0, of_beating = 0;
  for (int i = 0; i < 4000; ++i) {
    const double angle = 1e-3 * i, r = 0.0275 + 0.003 * std::cos(0.013 * i);
    const glm::dvec3 dir(std::cos(angle), 0.8 * std::sin(angle), 0.6 * std::sin(angle));
    const TickOutput out = hand.to(r * dir);
    const double beating = shell_radius_m(out.first, kFrames), wall = std::max(0.0285, beating);
    (beating > 0.0285 ? of_beating : of_still) += wall > r;
    worst = std::max(worst, glm::length(out.wanted_n - kStiffness * std::max(0.0, wall - r) * dir));
  }
  std::printf("two volumes: worst error %.4f N\n", worst);
  EXPECT_GT(of_still, 100);
  EXPECT_GT(of_beating, 100);
  EXPECT_LE(worst, kMethod_n);
}

/// A half space of high value below y = 0, which is the same after any motion along it.
class Floor final : public FrameData {
 public:
  bool is_vector() const noexcept override { return false; }
  double scalar(glm::dvec3 x) const noexcept override { return -1e6 * x.y; }
  glm::dvec3 scalar_gradient(glm::dvec3) const noexcept override { return {0.0, -1e6, 0.0}; }
  glm::dvec3 vector(glm::dvec3 x) const noexcept override { return scalar_gradient(x); }
  glm::dmat3 vector_jacobian(glm::dvec3) const noexcept override { return glm::dmat3(0.0); }
  double detail_m() const noexcept override { return 1e-3; }
  glm::dvec3 low_m() const noexcept override { return glm::dvec3(-0.1); }
  glm::dvec3 high_m() const noexcept override { return glm::dvec3(0.1); }
};

TEST(SeveralMotions, OfOneVolumeCarryEachModeWithItsOwn) {
  // The same floor flows to the right by one motion and to the left by the other. Its friction
  // drags the hand by mu N in that direction.
  auto data = std::make_shared<MovingVolume>();
  data->name = "shell";
  data->frames = {std::make_shared<Floor>(), std::make_shared<Floor>()};
  data->times.times_s = {0.0, 10.0};
  const Grid grid = shell_grid(8.0);
  const auto flow = [&](double x_m) {
    const glm::vec3 u(lps_from_volume({x_m, 0.0, 0.0}));
    return MotionMap::of(Field{grid, std::vector<glm::vec3>(grid.count(), u)});
  };
  data->motions = {{"right", {flow(0.1)}}, {"left", {flow(-0.1)}}};
  SceneSpec spec = shell_spec(10.0, 0.0, kStiffness);
  spec.modes[0].strength = *TransferFunction::stepped({0.0, 0.0}, {0.0, 10.0});
  spec.modes[0].friction = TransferFunction::constant(0.5);
  const double depth = 2e-3, normal = kStiffness * depth;
  const auto felt = [&](std::vector<std::string> motions) {
    SceneSpec of = spec;
    of.modes.clear();
    for (const std::string& motion : motions) {
      of.modes.push_back(spec.modes[0]);
      of.modes.back().name = "floor " + std::to_string(of.modes.size());
      of.modes.back().motion = motion;
    }
    Hand hand(of, {data});
    TickOutput out;
    for (int i = 0; i < 1500; ++i) out = hand.to({0.0, i < 50 ? 1e-3 : -depth, 0.0});
    EXPECT_NEAR(out.wanted_n.y, normal, 1e-3);
    return out.wanted_n.x;
  };
  EXPECT_NEAR(felt({"right"}), 0.5 * normal, 1e-3);
  EXPECT_NEAR(felt({"left"}), -0.5 * normal, 1e-3);
  EXPECT_NEAR(felt({""}), 0.5 * normal, 1e-3) << "the first one, where none is named";
  // Both motions: equal planes share the normal force, and their friction forces cancel.
  EXPECT_NEAR(felt({"right", "left"}), 0.0, 0.02);
}

}  // namespace
}  // namespace palpate
