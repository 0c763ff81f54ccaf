// A finger pad: a tool of several points. Oracles: each point is felt as a tool of its own. So on
// planes, a sphere, an edge and in a corner of two planes force and torque are sums over points
// that are known in closed form. Also: the ledger of energy.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/haptics/shell_scene.h"
#include "tests/support/random.h"

namespace palpate {
namespace {

using namespace test;

constexpr double kPad_m = 0.006, kStiff_n_per_m = 600.0;
constexpr double kNear_n = 2e-3, kNear_n_m = 1e-5;

/// A signed distance, mm, above 0 inside, as a formula.
template <class Distance>
class PadWall final : public FrameData {
 public:
  explicit PadWall(Distance distance) : distance_(distance) {}
  bool is_vector() const noexcept override { return false; }
  double scalar(glm::dvec3 x) const noexcept override { return 1e3 * distance_(x).value; }
  glm::dvec3 scalar_gradient(glm::dvec3 x) const noexcept override {
    return 1e3 * distance_(x).gradient;
  }
  glm::dvec3 vector(glm::dvec3 x) const noexcept override { return scalar_gradient(x); }
  glm::dmat3 vector_jacobian(glm::dvec3) const noexcept override { return glm::dmat3(0.0); }
  double detail_m() const noexcept override { return 1e-3; }
  glm::dvec3 low_m() const noexcept override { return glm::dvec3(-0.1); }
  glm::dvec3 high_m() const noexcept override { return glm::dvec3(0.1); }

 private:
  Distance distance_;
};

const auto kTable = [](glm::dvec3 x) -> ScalarSample { return {-x.y, {0.0, -1.0, 0.0}}; };
const auto kWallInX = [](glm::dvec3 x) -> ScalarSample { return {-x.x, {-1.0, 0.0, 0.0}}; };
const auto kHill = [](glm::dvec3 x) -> ScalarSample {
  return {0.02 - glm::length(x), -glm::normalize(x)};
};
/// A table that ends at x = 0.
const auto kTableEdge = [](glm::dvec3 x) -> ScalarSample {
  return x.x < x.y ? ScalarSample{-x.y, {0.0, -1.0, 0.0}} : ScalarSample{-x.x, {-1.0, 0.0, 0.0}};
};

template <class Distance>
std::shared_ptr<const MovingVolume> wall_of(Distance distance) {
  auto volume = std::make_shared<MovingVolume>();
  volume->name = "shell";
  volume->times.times_s = {0.0};
  volume->frames = {std::make_shared<PadWall<Distance>>(distance)};
  return volume;
}

SceneSpec pad_spec(int points, double friction = 0.0) {
  SceneSpec spec = shell_spec(50.0, friction, kStiff_n_per_m);
  spec.modes[0].strength = *TransferFunction::stepped({-1.0, 0.0}, {0.0, 50.0});
  spec.tool_points = points;
  spec.tool_radius_m = points > 1 ? kPad_m : 0.0;
  return spec;
}

/// The grip's shaft up, so that a pad lies flat on the table, then turned about an axis.
glm::dquat held(double angle = 0.0, glm::dvec3 about = {1.0, 0.0, 0.0}) {
  return glm::angleAxis(angle, glm::normalize(about)) *
         glm::angleAxis(-0.5 * std::numbers::pi, glm::dvec3(1.0, 0.0, 0.0));
}

/// Where the points are for a hand at 0, as docs/scene-file.md says.
std::vector<glm::dvec3> levers(int points, glm::dquat grip) {
  std::vector<glm::dvec3> all;
  const int around = points == 1 ? 0 : std::min(points, 4);
  for (int i = 0; i < around; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / around;
    all.push_back(grip * glm::dvec3(kPad_m * std::cos(angle), kPad_m * std::sin(angle), 0.0));
  }
  if (points == 1 || points == 5) all.emplace_back(0.0);
  return all;
}

/// Takes the hand slowly to a place, and lets it rest there.
TickOutput press(Hand& hand, glm::dquat grip, glm::dvec3 from, glm::dvec3 to) {
  hand.input.reading.grip.turns = true;
  hand.input.reading.grip.device_from_grip = grip;
  TickOutput out;
  for (int i = 0; i <= 500; ++i) out = hand.to(from + (to - from) * (i / 500.0));
  for (int i = 0; i < 3000; ++i) out = hand.to(to);
  return out;
}

struct Wrench {
  glm::dvec3 force_n{0.0}, torque_n_m{0.0};
};

/// The sum over the points of a rigid pad at `hand`, of which each is pressed out of the wall by
/// out(place of the point), m.
template <class Out>
Wrench expected(int points, glm::dquat grip, glm::dvec3 hand, Out out) {
  Wrench sum;
  for (const glm::dvec3& lever : levers(points, grip)) {
    const glm::dvec3 force_n = kStiff_n_per_m / points * out(hand + lever);
    sum.force_n += force_n;
    sum.torque_n_m += glm::cross(lever, force_n);
  }
  return sum;
}

void expect_wrench(const TickOutput& out, const Wrench& wanted) {
  EXPECT_LT(glm::distance(out.wanted_n, wanted.force_n), kNear_n)
      << out.wanted_n.x << ' ' << out.wanted_n.y << ' ' << out.wanted_n.z;
  EXPECT_LT(glm::distance(out.command.torque_n_m, wanted.torque_n_m), kNear_n_m)
      << out.command.torque_n_m.x << ' ' << out.command.torque_n_m.y << ' '
      << out.command.torque_n_m.z;
}

TEST(PadTool, LyingFlatOnAPlaneIsAsStiffAsAPoint) {
  const glm::dvec3 above{0.003, 0.004, 0.002}, pressed{0.003, -0.004, 0.002};
  for (int points = 1; points <= kMostToolPoints; ++points) {
    SCOPED_TRACE(points);
    Hand hand(pad_spec(points), {wall_of(kTable)});
    const TickOutput out = press(hand, held(), above, pressed);
    expect_wrench(out, {{0.0, 0.004 * kStiff_n_per_m, 0.0}, {}});
    EXPECT_NEAR(out.proxy_m.y, 0.0, 1e-6);
  }
}

TEST(PadTool, TiltedOnAPlaneFeelsItsLowerSideAndATorque) {
  for (int points = 2; points <= kMostToolPoints; ++points)
    for (const double angle : {0.2, -0.6}) {
      SCOPED_TRACE(testing::Message() << points << " points, " << angle);
      const glm::dquat grip = held(angle, {0.3, 0.0, 1.0});
      const glm::dvec3 pressed{0.0, -0.002, 0.0};
      Hand hand(pad_spec(points), {wall_of(kTable)});
      const TickOutput out = press(hand, grip, {0.0, 0.010, 0.0}, pressed);
      const Wrench wanted = expected(points, grip, pressed, [](glm::dvec3 at) {
        return glm::dvec3(0.0, std::max(0.0, -at.y), 0.0);
      });
      EXPECT_GT(glm::length(wanted.torque_n_m), 3e-4);
      expect_wrench(out, wanted);
    }
}

TEST(PadTool, OnASphereEachPointIsPressedOutAlongItsRadius) {
  for (const int points : {3, 4, 5}) {
    SCOPED_TRACE(points);
    const glm::dquat grip = held(0.3, {0.0, 0.0, 1.0});
    const glm::dvec3 pressed{0.002, 0.0165, -0.001};
    Hand hand(pad_spec(points), {wall_of(kHill)});
    const TickOutput out = press(hand, grip, {0.002, 0.030, -0.001}, pressed);
    expect_wrench(out, expected(points, grip, pressed, [](glm::dvec3 at) {
                    return std::max(0.0, 0.02 - glm::length(at)) * glm::normalize(at);
                  }));
  }
}

TEST(PadTool, OverAnEdgeIsTurnedByThePointsThatAreOnTheTable) {
  // Of four points one is beyond the edge, two are near it.
  const glm::dvec3 pressed{-0.004, -0.003, 0.0};
  Hand hand(pad_spec(4), {wall_of(kTableEdge)});
  const TickOutput out = press(hand, held(), {-0.004, 0.003, 0.0}, pressed);
  const Wrench wanted = expected(4, held(), pressed, [](glm::dvec3 at) {
    return at.x < at.y ? glm::dvec3(0.0, -at.y, 0.0) : glm::dvec3(0.0);
  });
  EXPECT_NEAR(wanted.force_n.y, 0.75 * 0.003 * kStiff_n_per_m, 1e-12);
  EXPECT_LT(wanted.torque_n_m.z, -2e-3);
  expect_wrench(out, wanted);
}

TEST(PadTool, InAnInnerCornerOfTwoPlanesFeelsBoth) {
  SceneSpec spec = pad_spec(5);
  spec.volumes.push_back(spec.volumes[0]);
  spec.volumes[1].name = "wall";
  spec.modes.push_back(spec.modes[0]);
  spec.modes[1].name = "second";
  spec.modes[1].volume = "wall";
  const glm::dquat grip = held(0.4, {0.2, 0.5, 1.0});
  const glm::dvec3 pressed{0.003, -0.001, 0.0};
  Hand hand(spec, {wall_of(kTable), wall_of(kWallInX)});
  const TickOutput out = press(hand, grip, {0.012, 0.010, 0.0}, pressed);
  const Wrench wanted = expected(5, grip, pressed, [](glm::dvec3 at) {
    return glm::dvec3(std::max(0.0, -at.x), std::max(0.0, -at.y), 0.0);
  });
  EXPECT_GT(std::min(wanted.force_n.x, wanted.force_n.y), 0.2);
  expect_wrench(out, wanted);
}

// Turned about the vertical with friction, each point sticks until its own friction slips: the
// torque is friction times the points' forces times the radius, against the turn.
TEST(PadTool, RubsAgainstATurn) {
  constexpr double kRubs = 0.5, kPressed_m = 0.003;
  Hand hand(pad_spec(4, kRubs), {wall_of(kTable)});
  press(hand, held(), {0.0, 0.003, 0.0}, {0.0, -kPressed_m, 0.0});
  TickOutput out;
  for (int i = 0; i < 1500; ++i) {
    hand.input.reading.grip.device_from_grip = held(1e-3 * i, {0.0, 1.0, 0.0});
    out = hand.to({0.0, -kPressed_m, 0.0});
  }
  const double normal_n = kPressed_m * kStiff_n_per_m;
  // The spring of a point that slides along its circle leads to a proxy that trails on a smaller
  // one.
  const double trails_m = kRubs * kPressed_m;
  const double lever_m = std::sqrt(kPad_m * kPad_m - trails_m * trails_m);
  EXPECT_NEAR(out.command.torque_n_m.y, -kRubs * normal_n * lever_m, 2e-4);
  EXPECT_NEAR(out.wanted_n.y, normal_n, kNear_n);
  EXPECT_LT(glm::length(glm::dvec2(out.wanted_n.x, out.wanted_n.z)), kNear_n);
}

TEST(PadTool, OfADeviceThatSensesNoOrientationFacesAwayFromTheUser) {
  Hand hand(pad_spec(5), {wall_of([](glm::dvec3 x) -> ScalarSample {
              return {-x.z, {0.0, 0.0, -1.0}};
            })});
  TickOutput out;
  for (int i = 0; i <= 1000; ++i) out = hand.to({0.0, 0.0, 0.004 - 8e-6 * i});
  for (int i = 0; i < 3000; ++i) out = hand.to({0.0, 0.0, -0.004});
  expect_wrench(out, {{0.0, 0.0, 0.004 * kStiff_n_per_m}, {}});
}

TEST(PadTool, OrientationThatIsLostForAWhileStaysAsItWas) {
  Hand hand(pad_spec(4), {wall_of(kTable)});
  const glm::dquat grip = held(0.5, {0.0, 0.0, 1.0});
  const TickOutput before = press(hand, grip, {0.0, 0.01, 0.0}, {0.0, -0.002, 0.0});
  hand.input.reading.grip = {};
  const TickOutput after = hand.to({0.0, -0.002, 0.0});
  EXPECT_EQ(after.wanted_n, before.wanted_n);
  EXPECT_GT(glm::length(before.wanted_n), 0.5);
}

// A device that is magnified by the scene: the lever is that at the hand.
TEST(PadTool, TorqueIsThatAtTheHandOfAMagnifiedWorld) {
  SceneSpec spec = pad_spec(4);
  spec.world_from_device.scale = glm::dvec3(2.0);
  Hand hand(spec, {wall_of(kTableEdge)});
  const glm::dvec3 pressed{-0.004, -0.003, 0.0};
  const TickOutput out = press(hand, held(), {-0.002, 0.0015, 0.0}, 0.5 * pressed);
  Wrench wanted = expected(4, held(), pressed, [](glm::dvec3 at) {
    return at.x < at.y ? glm::dvec3(0.0, -at.y, 0.0) : glm::dvec3(0.0);
  });
  wanted.torque_n_m *= 0.5;
  expect_wrench(out, wanted);
}

// With all limiters of the scene at work: over any run the work on the hand is the spring's loss
// plus what the scene and sampling put in. A device without torque does no work on a hand that
// turns.
TEST(PadTool, TheWorkOnTheHandIsAccountedForAlsoWhereItTurns) {
  const auto beating = shell(4, 8.0, Made::kAnalytic, 2.0);
  for (uint32_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    const int points = 2 + int(seed) % 4;
    SceneSpec spec = shell_spec(random.draw(2.0, 20.0), random.draw(0.0, 0.5), 800.0);
    spec.tool_points = points;
    spec.tool_radius_m = kPad_m;
    HapticsOptions options;
    options.lead = false;
    options.tank = {seed % 2 ? 0.0005 : 0.1, 0.01, 0.5};
    Hand hand(spec, {beating}, options);
    double work_j = 0.0;
    int slips = 0;
    glm::dvec3 last_m{0.0, 0.0, 0.05}, last_n{0.0};
    TickOutput out;
    for (int ms = 0; ms < 3000; ++ms) {
      const double t = 1e-3 * ms;
      const glm::dvec3 at = (0.024 + 0.01 * std::cos(9.0 * t)) *
                            glm::normalize(glm::dvec3(std::sin(2.0 * t), 0.4, std::cos(2.0 * t)));
      hand.input.reading.grip.turns = true;
      hand.input.reading.grip.device_from_grip =
          glm::angleAxis(1.5 * std::sin(7.0 * t), glm::dvec3(0.6, 0.8, 0.0));
      out = hand.to(at);
      work_j += glm::dot(last_n, at - last_m);
      last_m = at;
      last_n = out.wanted_n;
      slips += out.ledger[Limiter::kTank] != glm::dvec3(0.0);
    }
    double spring_j = 0.0;
    const PointsSnapshot places = hand.haptics.points();
    const auto arms = levers(points, hand.input.reading.grip.device_from_grip);
    ASSERT_EQ(places.count, points);
    for (int i = 0; i < points; ++i) {
      const glm::dvec3 stretch = places.proxies_m[size_t(i)] - (last_m + arms[size_t(i)]);
      spring_j += 0.5 * 800.0 / points * glm::dot(stretch, stretch);
    }
    const EnergyLedger ledger = hand.haptics.tank().ledger();
    EXPECT_NEAR(work_j, ledger.put_in_j - ledger.dissipated_j + ledger.sampling_j - spring_j, 1e-9);
    EXPECT_EQ(slips > 0, ledger.slips > 0);
    if (seed % 2) {
      EXPECT_GT(slips, 10);
    }
  }
}

// A change that neither hand nor material explains comes slowly also at one point of several: the
// sum keeps the rate of the bridge.
TEST(PadTool, ASwitchedSceneMakesNoStepOfForceOrTorque) {
  HapticsOptions options;
  options.lead = false;
  options.safety.start_ramp_s = 0.01;
  Hand hand(pad_spec(5), {wall_of(kTable)}, options);
  const glm::dquat grip = held(0.3, {0.0, 0.0, 1.0});
  TickOutput before = press(hand, grip, {0.0, 0.01, 0.0}, {0.0, -0.002, 0.0});
  ASSERT_GT(glm::length(before.command.torque_n_m), 1e-3);
  int points = 3;
  for (int round = 0; round < 4; ++round) {
    if (round < 3)
      hand.haptics.adopt(Haptics::prepare(*plan(pad_spec(points), {wall_of(kTable)})));
    else
      hand.haptics.adopt(nullptr);
    points -= 1;
    for (int ms = 0; ms < 600; ++ms) {
      const TickOutput out = hand.to({0.0, -0.002, 0.0});
      ASSERT_LT(glm::distance(out.wanted_n, before.wanted_n), 0.031) << round << ' ' << ms;
      ASSERT_LT(glm::distance(out.command.torque_n_m, before.command.torque_n_m), 2.0 * kPad_m)
          << round << ' ' << ms;
      before = out;
    }
  }
  EXPECT_EQ(before.command.force_n, glm::dvec3(0.0));
  EXPECT_EQ(before.command.torque_n_m, glm::dvec3(0.0));
}

TEST(PadTool, StandsInThePlan) {
  EXPECT_NE(text(**plan(pad_spec(5), {wall_of(kTable)})).find("5 points"), std::string::npos);
  EXPECT_EQ(text(**plan(pad_spec(1), {wall_of(kTable)})).find("points:"), std::string::npos);
}

TEST(PadTool, HasOneToFivePointsAndARadiusOfItsOwn) {
  SceneSpec spec = pad_spec(3);
  for (const int points : {0, -1, 6}) {
    spec.tool_points = points;
    const auto refused = plan(spec, {wall_of(kTable)});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().message, "The tool can have 1 to 5 points.");
  }
  spec.tool_points = 2;
  spec.tool_radius_m = 0.0;
  const auto small = plan(spec, {wall_of(kTable)});
  ASSERT_TRUE(small);
  EXPECT_EQ((*small)->points_m[0], glm::dvec3(0.005, 0.0, 0.0));
}

}  // namespace
}  // namespace palpate
