// The force of a volume that is moved from outside. Oracle: a ball on a circle in closed form; the
// exact path is the reference for the error that a path adds.
#include <gtest/gtest.h>

#include "module/scene/drive.h"
#include "tests/haptics/guard/force_steps.h"
#include "tests/haptics/shell_scene.h"
#include "tests/support/random.h"

namespace palpate {
namespace {

using namespace test;

constexpr double kMovingStiffness = 600.0;
// The proxy follows the nearest point of the wall with the error that one pass of the sweep leaves;
// the required limit for a moving wall is 0.05 N.
constexpr double kMethod_n = 0.01;
// N per ms beyond the exact path: the required limit.
constexpr double kMost_n = 0.02;

/// The ball rotates about an axis 10 mm away, once per second: 63 mm/s.
DriveSpec turning() {
  DriveSpec drive;
  drive.kind = DriveSpec::Kind::kTurn;
  drive.axis = {0.0, 0.0, 1.0};
  drive.rate_hz = 1.0;
  return drive;
}

Transform aside() {
  Transform transform;
  transform.translation_m = {0.01, 0.0, 0.0};
  return transform;
}

const glm::dvec3 kHand(0.022, 0.0, 0.004);

SceneSpec moved(PosePath path, DriveSpec::Kind kind) {
  SceneSpec spec = shell_spec(50.0, 0.0, kMovingStiffness);
  spec.volumes[0].transform = aside();
  spec.volumes[0].drive = turning();
  spec.volumes[0].drive.kind = kind;
  spec.volumes[0].path = path;
  return spec;
}

/// What a hand at rest feels on a path.
struct Felt {
  double step_n = 0.0;  ///< largest change in a ms
  /// The largest change of that change, felt as a tick.
  double bend_n = 0.0;
  /// The error from the closed form for the present pose.
  double error_n = 0.0;
  int touched = 0;
};

class Feeling {
 public:
  void add(const Hand& hand, const TickOutput& out) {
    const VolumeRun& volume = hand.haptics.run()->volumes[0];
    const glm::dvec3 arm = out.probe_m - volume.offset;
    const double deep = std::max(0.0, 0.025 - glm::length(arm));
    felt.error_n = std::max(
        felt.error_n, glm::length(out.wanted_n - kMovingStiffness * deep * glm::normalize(arm)));
    const glm::dvec3 change = out.wanted_n - last_n_;
    felt.touched += deep > 0.0;
    // The begin of contact bends the force on every path, so the first ticks do not count.
    if (deep > 0.0 && ++row_ > 2) {
      felt.step_n = std::max(felt.step_n, glm::length(change));
      felt.bend_n = std::max(felt.bend_n, glm::length(change - last_change_));
    }
    if (!(deep > 0.0)) row_ = 0;
    last_change_ = change;
    last_n_ = out.wanted_n;
  }
  Felt felt;

 private:
  glm::dvec3 last_n_{0.0}, last_change_{0.0};
  int row_ = 0;
};

/// Poses come at the ends of frames of 11 to 22 ms. `stalls` are times (ms) from which no pose
/// comes for 300 ms.
Felt feel_frames(PosePath path, uint32_t seed, const std::vector<int>& stalls = {}) {
  Hand hand(moved(path, DriveSpec::Kind::kSecondHand), {shell(1, 1.0)});
  test::Random random(seed);
  Feeling feeling;
  double next_ms = 0.0;
  for (int i = 1; i <= 6000; ++i) {
    bool stalled = false;
    for (const int from : stalls) stalled |= i >= from && i < from + 300;
    if (i >= next_ms && !stalled) {
      PoseUpdate& pose = hand.input.poses[0];
      pose.volume = 0;
      pose.time_ns = int64_t(1e6 * next_ms);
      if (i - next_ms > 1.0) pose.time_ns = int64_t(i) * 1'000'000;  // after a stall
      pose.transform = driven(turning(), aside(), 1e-9 * double(pose.time_ns));
      hand.input.pose_count = 1;
      next_ms = std::max(next_ms, double(i) - 1.0) + random.draw(11.0, 22.0);
    }
    const TickOutput out = hand.to(kHand);
    if (i > 500) feeling.add(hand, out);
  }
  return feeling.felt;
}

Felt feel_exact() {
  Hand hand(moved(PosePath::kExact, DriveSpec::Kind::kTurn), {shell(1, 1.0)});
  Feeling feeling;
  for (int i = 1; i <= 6000; ++i) {
    const TickOutput out = hand.to(kHand);
    if (i > 500) feeling.add(hand, out);
  }
  return feeling.felt;
}

TEST(MovedVolume, MakesNoTickAtTheEndsOfFramesThatVaryTwoToOne) {
  const Felt exact = feel_exact();
  EXPECT_GT(exact.touched, 1000);
  EXPECT_LE(exact.error_n, kMethod_n);
  double smooth_step = 0.0, paper_step = 0.0, smooth_bend = 0.0, paper_bend = 0.0;
  for (uint32_t seed = 1; seed <= 5; ++seed) {
    const Felt smooth = feel_frames(PosePath::kSmooth, seed);
    const Felt paper = feel_frames(PosePath::kPaper, seed);
    EXPECT_GT(smooth.touched, 1000);
    EXPECT_LE(smooth.error_n, kMethod_n) << "seed " << seed;
    EXPECT_LE(paper.error_n, kMethod_n) << "seed " << seed;
    smooth_step = std::max(smooth_step, smooth.step_n);
    paper_step = std::max(paper_step, paper.step_n);
    smooth_bend = std::max(smooth_bend, smooth.bend_n);
    paper_bend = std::max(paper_bend, paper.bend_n);
  }
  std::printf(
      "force step at frame ends, N per ms: exact %.4f, smooth %.4f (%+.4f), paper %.4f "
      "(%+.4f); tick: exact %.5f, smooth %.5f, paper %.5f\n",
      exact.step_n, smooth_step, smooth_step - exact.step_n, paper_step, paper_step - exact.step_n,
      exact.bend_n, smooth_bend, paper_bend);
  EXPECT_LE(smooth_step - exact.step_n, kMost_n);
  // The paper's own path, for comparison: it has the tick (its Fig. 15), the smooth path does not.
  EXPECT_GT(paper_bend, 5.0 * smooth_bend);
}

TEST(MovedVolume, GoesOnSoftlyAfterItsSourceHasStalled) {
  const Felt exact = feel_exact();
  for (const PosePath path : {PosePath::kSmooth, PosePath::kPaper}) {
    const Felt felt = feel_frames(path, 1, {1500, 3000, 4400});
    std::printf("stalled source, path %d: worst step %.4f N per ms (exact %.4f)\n", int(path),
                felt.step_n, exact.step_n);
    // A pause is replayed at up to three times the recent speed, by a clock that is up to one half
    // fast while it is behind. The paper's path moves the volume by 1.1 mm in a ms; that is only
    // printed.
    if (path == PosePath::kSmooth) {
      EXPECT_LE(felt.error_n, kMethod_n);
      EXPECT_LE(felt.step_n, 3.0 * 1.5 * exact.step_n);
    }
  }
}

TEST(MovedVolume, TurnsThroughHalfTurnsWithoutAJump) {
  // Each new pose is about half a turn from the last one.
  SceneSpec spec = moved(PosePath::kSmooth, DriveSpec::Kind::kSecondHand);
  spec.volumes[0].transform.translation_m.x *= -1.0;  // away from the hand at first
  Hand hand(spec, {shell(1, 1.0)});
  ForceSteps steps;
  test::Random random(7);
  Feeling feeling;
  double angle = std::numbers::pi;
  for (int i = 1; i <= 6000; ++i) {
    if (i % 400 == 0) {
      angle += std::numbers::pi * (1.0 + random.draw(-1e-9, 1e-9));
      PoseUpdate& pose = hand.input.poses[0];
      pose = {0, aside(), int64_t(i) * 1'000'000};
      pose.transform.rotation = glm::angleAxis(angle, glm::normalize(glm::dvec3(0.3, 1.0, -0.2)));
      pose.transform.translation_m = pose.transform.rotation * aside().translation_m;
      hand.input.pose_count = 1;
    }
    const TickOutput out = hand.to(kHand);
    ASSERT_TRUE(std::isfinite(glm::length(out.wanted_n))) << "tick " << i;
    steps.add(out);
    feeling.add(hand, out);
  }
  std::printf("half turns: worst step %.4f N per ms\n", steps.worst_n());
  EXPECT_GT(feeling.felt.touched, 500);
  EXPECT_LE(feeling.felt.error_n, kMethod_n);
  // Half a turn, 10 mm from the axis, takes at least 0.25 s. A smooth start and stop at most
  // doubles the mean speed, and so does the nearest point of a ball to a hand 12.6 mm from its
  // centre.
  EXPECT_LE(steps.worst_n(), kMovingStiffness * 2.0 * 2.0 * 1e-3 * 0.01 * std::numbers::pi / 0.25);
}

/// The point of an ellipsoid about the origin that is nearest to x (outside the middle), by
/// Newton on the multiplier: p = x / (1 + l / a^2).
glm::dvec3 nearest(glm::dvec3 x, glm::dvec3 half_axes) {
  const glm::dvec3 squared = half_axes * half_axes;
  double low = -0.999 * std::min({squared.x, squared.y, squared.z}), high = 0.0;
  for (int i = 0; i < 200; ++i) {
    const double l = 0.5 * (low + high);
    const glm::dvec3 p = x / (1.0 + l / squared);
    (glm::dot(p * p, 1.0 / squared) > 1.0 ? low : high) = l;
  }
  return x / (1.0 + high / squared);
}

TEST(MovedVolume, WithAScaleThatDiffersByAxisPressesAlongTheTrueNormal) {
  SceneSpec spec = shell_spec(50.0, 0.0, kMovingStiffness);
  Transform& at = spec.volumes[0].transform;
  at.scale = {1.0, 1.4, 0.7};
  at.rotation = glm::angleAxis(0.8, glm::normalize(glm::dvec3(1.0, -2.0, 0.5)));
  at.translation_m = {0.003, -0.002, 0.001};
  const glm::dvec3 half_axes = 0.025 * at.scale;
  double worst = 0.0;
  test::Random random(3);
  for (int run = 0; run < 20; ++run) {
    Hand hand(spec, {shell(1, 1.0)});
    const glm::dvec3 dir = glm::normalize(random.vector(1.0));
    // 1.5 mm inside the surface along a random direction in volume space.
    const glm::dvec3 surface = dir / glm::length(dir / half_axes);
    TickOutput out;
    for (int i = 0; i <= 400; ++i) {
      const double share = std::min(1.0, i / 200.0);
      out = hand.to(at.translation_m + at.rotation * (surface * (1.3 - (0.3 + 0.06) * share)));
    }
    const glm::dvec3 x = glm::conjugate(at.rotation) * (out.probe_m - at.translation_m);
    const glm::dvec3 exact = at.rotation * (kMovingStiffness * (nearest(x, half_axes) - x));
    worst = std::max(worst, glm::length(out.wanted_n - exact));
  }
  std::printf("ellipsoid: worst error %.5f N\n", worst);
  EXPECT_LE(worst, 0.005);
}

TEST(MovedVolume, TakesNoMirrorImageWhileItRuns) {
  Hand hand(moved(PosePath::kExact, DriveSpec::Kind::kSecondHand), {shell(1, 1.0)});
  for (int i = 0; i < 300; ++i) hand.to(kHand * (2.0 - i / 300.0));
  for (int i = 0; i < 100; ++i) hand.to(kHand);
  const glm::dvec3 before = hand.to(kHand).wanted_n;
  EXPECT_GT(glm::length(before), 1.0);
  int64_t time_ns = 500'000'000;
  for (const glm::dvec3 scale :
       {glm::dvec3(-1.0, 1.0, 1.0), glm::dvec3(0.0), glm::dvec3(1.0, std::nan(""), 1.0)}) {
    hand.input.poses[0] = {0, aside(), time_ns += 1'000'000};
    hand.input.poses[0].transform.scale = scale;
    // There is no such volume.
    hand.input.poses[1] = {7, {}, time_ns};
    hand.input.pose_count = 2;
    EXPECT_EQ(hand.to(kHand).wanted_n, before);
  }
}

TEST(Assembling, RefusesTransformsAndNumbersThatCanNotBeFelt) {
  const auto refusal = [](auto change) {
    SceneSpec spec = shell_spec(5.0, 0.0, kMovingStiffness);
    change(spec);
    const auto scene = plan(spec, {shell(1, 1.0, Made::kAnalytic, 4.0)});
    return scene ? std::string() : scene.error().message;
  };
  const double none = std::nan("");
  EXPECT_EQ(refusal([](SceneSpec&) {}), "");
  EXPECT_NE(refusal([](SceneSpec& s) { s.volumes[0].transform.scale.y = -1.0; }).find("mirror"),
            std::string::npos);
  EXPECT_NE(refusal([](SceneSpec& s) { s.world_from_device.scale.x = -1.0; }).find("mirror"),
            std::string::npos);
  EXPECT_NE(refusal([](SceneSpec& s) { s.volumes[0].transform.scale.y = 1e5; }).find("scaled"),
            std::string::npos);
  EXPECT_NE(refusal([&](SceneSpec& s) {
              s.volumes[0].transform.translation_m.x = none;
            }).find("not finite"),
            std::string::npos);
  EXPECT_NE(refusal([](SceneSpec& s) { s.volumes[0].transform.rotation *= 2.0; }).find("rotation"),
            std::string::npos);
  for (const double stiffness : {0.0, -1.0, none, 1e300 * 1e300})
    EXPECT_NE(refusal([&](SceneSpec& s) { s.stiffness_n_per_m = stiffness; }).find("stiffness"),
              std::string::npos);
  for (const double damping : {-1.0, none})
    EXPECT_NE(refusal([&](SceneSpec& s) { s.damping_n_s_per_m = damping; }).find("damping"),
              std::string::npos);
  EXPECT_NE(refusal([&](SceneSpec& s) { s.modes[0].gain = none; }).find("wall"), std::string::npos);
}

}  // namespace
}  // namespace palpate
