// Faulty scenes: NaN in the data or the motion, nothing to feel, data out of reach.
#include <gtest/gtest.h>

#include <limits>

#include "module/scene/make_volume.h"
#include "tests/haptics/guard/force_steps.h"
#include "tests/haptics/shell_scene.h"

namespace palpate {
namespace {

using namespace test;

constexpr double kFaultStiffness = 600.0;
// N per ms, for a hand that holds still.
constexpr double kStep_n = 0.02;
// N per ms, where the force can not be determined.
constexpr double kFaultFadeStep_n = 0.05;
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

bool is_finite(glm::dvec3 v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

TEST(SceneFaults, DataThatAreNoNumbersAreRefusedWhenTheVolumeIsMade) {
  const Grid grid = shell_grid(8.0);
  for (const float wrong :
       {kNone, std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()}) {
    VolumeData data;
    data.frames.frames = {shell_frame(grid, 0, 1), shell_frame(grid, 0, 1)};
    data.frames.times_s = {0.0, 1.0};
    VolumeSpec spec;
    spec.name = "scan";
    ASSERT_TRUE(build(spec, data));
    data.frames.frames[1].values.back() = wrong;
    const auto made = build(spec, data);
    ASSERT_FALSE(made);
    EXPECT_NE(made.error().message.find("frame 1 holds values that are not finite"),
              std::string::npos)
        << made.error().message;
    VolumeData flow;
    flow.vectors = {{grid, std::vector<glm::vec3>(grid.count())}};
    ASSERT_TRUE(build(spec, flow));
    flow.vectors[0].values[17].z = wrong;
    EXPECT_FALSE(build(spec, flow));
  }
}

/// A ball, of which the upper half is not finite.
class HalfBall final : public FrameData {
 public:
  explicit HalfBall(double border_m, double soft_m = 1.06e-3)
      : ball_(0.025, soft_m), border_m_(border_m) {}
  bool is_vector() const noexcept override { return false; }
  double scalar(glm::dvec3 x) const noexcept override {
    return x.y > border_m_ ? double(kNone) : ball_.scalar(x);
  }
  glm::dvec3 scalar_gradient(glm::dvec3 x) const noexcept override {
    return x.y > border_m_ ? glm::dvec3(double(kNone)) : ball_.scalar_gradient(x);
  }
  glm::dvec3 vector(glm::dvec3 x) const noexcept override { return scalar_gradient(x); }
  glm::dmat3 vector_jacobian(glm::dvec3) const noexcept override {
    return glm::dmat3(double(kNone));
  }
  double detail_m() const noexcept override { return 1e-3; }
  glm::dvec3 low_m() const noexcept override { return glm::dvec3(-0.048); }
  glm::dvec3 high_m() const noexcept override { return glm::dvec3(0.048); }

 private:
  Ball ball_;
  double border_m_;
};

std::shared_ptr<MovingVolume> half_ball(double border_m, int frames = 1) {
  auto volume = std::make_shared<MovingVolume>();
  volume->name = "shell";
  for (int k = 0; k < frames; ++k) {
    volume->frames.push_back(std::make_shared<HalfBall>(border_m));
    volume->times.times_s.push_back(k);
  }
  return volume;
}

TEST(SceneFaults, DataThatAreNoNumbersFadeWhereTheHandComesToThem) {
  for (const char* kind :
       {"surface", "gradient-force", "follow", "front", "attractor", "tissue", "viscosity"}) {
    SceneSpec spec = shell_spec(6.0, 0.2, kFaultStiffness);
    spec.modes[0].kind = kind;
    if (spec.modes[0].kind != "surface") spec.modes[0].strength = TransferFunction::constant(1.0);
    // So soft that the force changes more slowly along the way than the spring's.
    spec.modes[0].gain = 7e-6;
    auto data = half_ball(0.004);
    data->frames = {std::make_shared<HalfBall>(0.004, 0.004)};
    Hand hand(spec, {data});
    for (int i = 0; i < 2200; ++i) hand.to({0.04, 0.0, 0.0});
    for (int i = 0; i < 500; ++i) hand.to({0.04 - 0.018 * i / 500.0, 0.0, 0.0});
    ForceSteps steps;
    bool told = false;
    // Up along the ball at 10 mm/s, across the border of the finite values.
    for (int i = 0; i < 1500; ++i) {
      const TickOutput out = hand.to({0.022, 1e-5 * i, 0.0});
      ASSERT_TRUE(is_finite(out.wanted_n) && is_finite(out.proxy_m) &&
                  is_finite(out.command.force_n))
          << kind << " tick " << i;
      steps.add(out);
      told |= out.frozen;
    }
    EXPECT_TRUE(told) << kind;
    EXPECT_LE(glm::length(steps.last_n()), 1e-9) << kind << ": nothing is there to be felt";
    // The hand's own motion, 10 um per tick, is 0.006 N of it.
    EXPECT_LE(steps.worst_n(), kFaultFadeStep_n + 0.006) << kind;
  }
}

/// A plane at y = 0, and a force along y, with the strength and the place that the test sets.
class Plate final : public Mode {
 public:
  static inline double strength_n = 2.0, height_m = 0.0;
  void place(const ModePoint& at, PrimitiveSink& out) const noexcept override {
    out.surface({at.proxy.x, height_m, at.proxy.z}, {0.0, 1.0, 0.0}, strength_n);
    out.force({0.0, 1.0, 0.0}, strength_n / 4.0);
  }
};

TEST(SceneFaults, PrimitivesThatAreNotFiniteAreNotPlaced) {
  ModeKinds kinds;
  kinds.add("plate", [](const ModeSpec&) -> Result<std::shared_ptr<const Mode>> {
    return std::shared_ptr<const Mode>(std::make_shared<Plate>());
  });
  SceneSpec spec = shell_spec(6.0, 0.2, kFaultStiffness);
  spec.modes[0].kind = "plate";
  const auto scene = plan(spec, {shell(1, 1.0)}, kinds);
  ASSERT_TRUE(scene) << scene.error().message;
  const double inf = std::numeric_limits<double>::infinity(), nan = double(kNone);
  for (const auto& [strength_n, height_m] :
       {std::pair{inf, 0.0}, {nan, 0.0}, {-inf, 0.0}, {2.0, nan}, {2.0, inf}}) {
    SCOPED_TRACE(testing::Message() << strength_n << " N at " << height_m);
    Plate::strength_n = 0.0;
    Plate::height_m = 0.0;
    Haptics haptics(unmetered(), Hand::device());
    haptics.adopt(Haptics::prepare(*scene));
    TickInput input;
    const auto tick = [&](double y_m) {
      input.now_ns += 1'000'000;
      input.dt_s = 1e-3;
      input.reading.time_ns = input.now_ns;
      input.reading.fresh = true;
      input.reading.position_m = {0.0, y_m, 0.0};
      return haptics.tick(input);
    };
    for (int k = 0; k < 200; ++k) tick(0.002);
    Plate::strength_n = 2.0;
    ForceSteps steps;
    for (int k = 0; k < 4000; ++k) steps.add(tick(std::max(-0.002, 0.002 - 2e-6 * k)));
    ASSERT_GT(steps.last_n().y, 1.0);
    Plate::strength_n = strength_n;
    Plate::height_m = height_m;
    for (int k = 0; k < 1000; ++k) {
      const TickOutput out = tick(-0.002);
      ASSERT_TRUE(is_finite(out.wanted_n) && is_finite(out.proxy_m)) << "tick " << k;
      steps.add(out);
    }
    // With only the height invalid, the force along y stays.
    const double rest_n = strength_n == 2.0 ? 0.5 : 0.0;
    EXPECT_NEAR(steps.last_n().y, rest_n, 0.01);
    EXPECT_LE(steps.worst_n(), kFaultFadeStep_n);
  }
}

TEST(SceneFaults, FieldsAndDataSwappedForSomeThatAreNoNumbersFade) {
  const glm::dvec3 at(0.02, 0.01, 0.0);
  // Invalid data.
  {
    Hand hand(shell_spec(6.0, 0.2, kFaultStiffness), {shell(1, 1.0)});
    for (int i = 0; i < 300; ++i) hand.to(at * (1.5 - 0.5 * i / 300.0));
    ForceSteps steps;
    for (int i = 0; i < 5; ++i) steps.add(hand.to(at));
    EXPECT_GT(glm::length(steps.last_n()), 1.0);
    const auto scene = plan(shell_spec(6.0, 0.2, kFaultStiffness), {half_ball(-1.0)});
    ASSERT_TRUE(scene);
    hand.haptics.adopt(Haptics::prepare(*scene));
    for (int i = 0; i < 1000; ++i) {
      const TickOutput out = hand.to(at);
      ASSERT_TRUE(is_finite(out.wanted_n)) << "tick " << i;
      EXPECT_TRUE(out.frozen);
      steps.add(out);
    }
    EXPECT_EQ(steps.last_n(), glm::dvec3(0.0));
    EXPECT_LE(steps.worst_n(), kStep_n);
  }
  // Invalid motion.
  {
    const auto good = shell(4, 1.0, Made::kAnalytic, 4.0);
    Hand hand(shell_spec(20.0, 0.2, kFaultStiffness), {good});
    for (int i = 0; i < 300; ++i) hand.to(at * (1.5 - 0.5 * i / 300.0));
    ForceSteps steps;
    for (int i = 0; i < 5; ++i) steps.add(hand.to(at));
    EXPECT_GT(glm::length(steps.last_n()), 1.0);
    auto bad = std::make_shared<MovingVolume>(*good);
    const Grid grid = shell_grid(4.0);
    const Field none{grid, std::vector<glm::vec3>(grid.count(), glm::vec3(kNone))};
    for (auto& step : bad->motions[0].steps) step = MotionMap::of(none);
    const auto scene = plan(shell_spec(20.0, 0.2, kFaultStiffness), {bad});
    ASSERT_TRUE(scene);
    hand.haptics.adopt(Haptics::prepare(*scene));
    for (int i = 0; i < 3000; ++i) {
      const TickOutput out = hand.to(at);
      ASSERT_TRUE(is_finite(out.wanted_n)) << "tick " << i;
      steps.add(out);
    }
    EXPECT_EQ(steps.last_n(), glm::dvec3(0.0)) << "a field without confidence is not felt";
    EXPECT_LE(steps.worst_n(), kStep_n);
  }
}

TEST(SceneFaults, AnEmptySceneGivesNoForceAndSaysThatItIsEmpty) {
  SceneSpec nothing;
  const auto scene = plan(nothing, {});
  ASSERT_TRUE(scene);
  Hand hand(nothing, {});
  Cause cause = Cause::kNone;
  for (int i = 0; i < 2500; ++i) {
    const TickOutput out = hand.to({0.03 * std::sin(0.01 * i), 0.0, 0.0});
    ASSERT_EQ(out.wanted_n, glm::dvec3(0.0));
    ASSERT_EQ(out.proxy_m, out.probe_m);
    cause = out.cause;
  }
  EXPECT_EQ(cause, Cause::kSceneEmpty);
}

TEST(SceneFaults, AVolumeWithoutAnythingInItIsNotFelt) {
  const Grid grid = shell_grid(8.0);
  auto flat = std::make_shared<MovingVolume>();
  flat->name = "shell";
  flat->times.times_s = {0.0};
  for (const float value : {0.0F, 1000.0F}) {
    flat->frames = {sampled_scalar(Volume{grid, std::vector<float>(grid.count(), value)})};
    Hand hand(shell_spec(6.0, 0.5, kFaultStiffness), {flat});
    for (int i = 0; i < 500; ++i)
      ASSERT_EQ(hand.to({0.06 - 2.4e-4 * i, 0.01, 0.0}).wanted_n, glm::dvec3(0.0));
  }
}

TEST(SceneFaults, AVolumeBehindTheWorkspaceIsNotFeltAndCostsNothingButLooks) {
  SceneSpec spec = shell_spec(6.0, 0.5, kFaultStiffness);
  spec.volumes[0].transform.translation_m = {1e3, -5e3, 2e4};
  Hand hand(spec, {shell(1, 1.0, Made::kSampled, 4.0)});
  for (int i = 0; i < 2000; ++i) {
    const TickOutput out = hand.to({0.03 * std::sin(0.01 * i), 0.01 * std::cos(0.02 * i), 0.0});
    ASSERT_EQ(out.wanted_n, glm::dvec3(0.0));
    ASSERT_EQ(out.proxy_m, out.probe_m);
  }
}

}  // namespace
}  // namespace palpate
