// A ball as tool. Oracles: planes and spheres, which a ball touches at a distance of its radius,
// and an inner corner, which keeps its middle that far from both walls.
#include <gtest/gtest.h>

#include "compute/volume/signed_distance.h"
#include "module/haptics/proxy/ball_contact.h"
#include "module/scene/segment_modes.h"
#include "tests/haptics/shell_scene.h"
#include "tests/support/random.h"

namespace palpate {
namespace {

using namespace test;

constexpr double kBall_m = 0.003;

/// A function of a place with its gradient, which is felt exactly.
template <class Function>
class Formula final : public FrameData {
 public:
  explicit Formula(Function function) : function_(function) {}
  bool is_vector() const noexcept override { return false; }
  double scalar(glm::dvec3 x) const noexcept override { return function_(x).value; }
  glm::dvec3 scalar_gradient(glm::dvec3 x) const noexcept override { return function_(x).gradient; }
  ScalarSample scalar_and_gradient(glm::dvec3 x) const noexcept override { return function_(x); }
  glm::dvec3 vector(glm::dvec3 x) const noexcept override { return function_(x).gradient; }
  glm::dmat3 vector_jacobian(glm::dvec3) const noexcept override { return glm::dmat3(0.0); }
  double detail_m() const noexcept override { return 1e-3; }
  glm::dvec3 low_m() const noexcept override { return glm::dvec3(-0.1); }
  glm::dvec3 high_m() const noexcept override { return glm::dvec3(0.1); }

 private:
  Function function_;
};

template <class Function>
std::shared_ptr<const FrameData> formula(Function function) {
  return std::make_shared<Formula<Function>>(function);
}

/// 1000 inside, 0 outside, soft over about 1 mm.
template <class Distance>
std::shared_ptr<const FrameData> values_of(Distance distance) {
  return formula([distance](glm::dvec3 x) -> ScalarSample {
    const ScalarSample d = distance(x);  // m, above 0 inside
    const double t = d.value / 0.5e-3;
    // Beyond 2 mm there is no slope that would show where the surface is.
    if (std::abs(t) > 4.0) return {t < 0.0 ? 0.0 : 1000.0, glm::dvec3(0.0)};
    const double slope = 500.0 / (std::cosh(t) * std::cosh(t)) / 0.5e-3;
    return {500.0 * (1.0 + std::tanh(t)), slope * d.gradient};
  });
}

/// The same as a segment's signed distance, mm.
template <class Distance>
std::shared_ptr<const FrameData> mm_of(Distance distance) {
  return formula([distance](glm::dvec3 x) -> ScalarSample {
    const ScalarSample d = distance(x);
    return {1e3 * d.value, 1e3 * d.gradient};
  });
}

const auto kFloor = [](glm::dvec3 x) -> ScalarSample { return {-x.y, {0.0, -1.0, 0.0}}; };
const auto kBump = [](glm::dvec3 x) -> ScalarSample {
  return {0.02 - glm::length(x), -glm::normalize(x)};
};
template <class Distance>
std::shared_ptr<const MovingVolume> volume_of(Distance distance) {
  auto volume = std::make_shared<MovingVolume>();
  volume->name = "shell";
  volume->times.times_s = {0.0};
  volume->frames = {values_of(distance)};
  volume->segments = {{"wall", glm::vec3(1.0F), {mm_of(distance)}}};
  return volume;
}

SceneSpec scene_of(bool segment, double scale) {
  SceneSpec spec = shell_spec(6.0, 0.0, 600.0);
  if (segment) {
    spec.modes[0].segment = "wall";
    spec.modes[0].strength = *TransferFunction::stepped({-1.0, 0.0}, {0.0, 6.0});
  }
  spec.volumes[0].transform.scale = glm::dvec3(scale);
  spec.tool_radius_m = kBall_m;
  return spec;
}

TEST(BallTool, TouchesPlanesAndSpheresAtItsRadius) {
  for (const bool segment : {true, false})
    for (const double scale : {1.0, 0.5}) {
      SCOPED_TRACE(testing::Message() << "segment " << segment << ", scale " << scale);
      Hand floor(scene_of(segment, scale), {volume_of(kFloor)});
      TickOutput out;
      for (int i = 0; i < 1000; ++i) {
        out = floor.to({1e-5 * i, 0.008 - 1e-5 * i, 0.004});
        if (out.probe_m.y > kBall_m) {
          ASSERT_EQ(out.wanted_n, glm::dvec3(0.0)) << out.probe_m.y;
        }
      }
      EXPECT_NEAR(out.proxy_m.y, kBall_m, 2e-6);
      EXPECT_NEAR(out.proxy_m.x, out.probe_m.x, 1e-9) << "nothing rubs";

      Hand bump(scene_of(segment, scale), {volume_of(kBump)});
      const glm::dvec3 side = glm::normalize(glm::dvec3(0.3, 0.8, -0.5));
      for (int i = 0; i < 1500; ++i)
        out = bump.to((0.02 * scale + kBall_m + 0.01 - 1e-5 * i) * side);
      for (int i = 0; i < 50; ++i) out = bump.to(out.probe_m);
      EXPECT_NEAR(glm::length(out.proxy_m), 0.02 * scale + kBall_m, 3e-6);
      EXPECT_LT(glm::length(glm::cross(out.proxy_m, side)), 2e-6);
    }
}

// A segment as users have them: a mask of 1 mm voxels, whose distance is smooth, with the walls'
// usual strength and stiffness.
TEST(BallTool, DoesNotEnterAnInnerCorner) {
  Mask mask;
  mask.grid.size = {48, 48, 24};
  mask.grid.origin_mm = -0.5 * glm::dvec3(mask.grid.size - 1);
  for (int k = 0; k < mask.grid.size.z; ++k)
    for (int j = 0; j < mask.grid.size.y; ++j)
      for (int i = 0; i < mask.grid.size.x; ++i) {
        const glm::dvec3 x = volume_from_lps(mask.grid.lps_from_index({i, j, k}));
        mask.values.push_back(x.x < 0.0 || x.z < 0.0);  // the room is where both are above 0
      }
  auto volume = std::make_shared<MovingVolume>();
  volume->name = "shell";
  volume->times.times_s = {0.0};
  volume->frames = {sampled_scalar(Volume{mask.grid, std::vector<float>(mask.grid.count())})};
  volume->segments = {{"wall", glm::vec3(1.0F), {sampled_scalar(signed_distance(mask))}}};
  SceneSpec spec = scene_of(true, 1.0);
  spec.modes[0].strength = segment_strength(SegmentSpec{}, 1.0);
  Hand hand(spec, {volume});
  TickOutput out;
  // To 5 mm behind both walls for a ball: no deeper than the wall yields to the force.
  for (int i = 0; i < 1200; ++i) {
    const double at = 0.010 - 1e-5 * i;
    out = hand.to({at, 0.0, at + 0.0005});
    const double yields_m = glm::length(out.wanted_n) / SegmentSpec{}.stiffness_n_per_m;
    ASSERT_GT(std::min(out.proxy_m.x, out.proxy_m.z), kBall_m - yields_m - 1e-6) << at;
  }
  EXPECT_GT(glm::length(out.wanted_n), 3.0);
}

TEST(BallTool, FindsTheGreatestValueOnItWhereverTheGradientAtItsMiddlePoints) {
  test::Random random(3);
  const auto frame = values_of(kBump);
  for (int round = 0; round < 200; ++round) {
    // The ball reaches 0.2 to 1 mm into the bump; from its middle the bump is not seen.
    const glm::dvec3 way = glm::normalize(random.vector(1.0));
    const glm::dvec3 middle = way * (0.02 + kBall_m - random.draw(0.2e-3, 1e-3));
    glm::dvec3 last(0.0);
    const ToolBall ball = ball_in_data(kBall_m, glm::dmat3(1.0));
    const glm::dvec3 found = ball_contact(*frame, middle, ball, last);
    EXPECT_LT(glm::length(found - (middle - kBall_m * way)), 1e-6) << round;
    EXPECT_LT(glm::length(last + way), 1e-3);
  }
}

TEST(BallTool, IsAnEllipsoidInAFrameThatIsStretched) {
  const glm::dmat3 stretch(glm::dvec3(2.0, 0.0, 0.0), glm::dvec3(0.3, 1.0, 0.0),
                           glm::dvec3(0.0, 0.0, 0.5));
  const ToolBall ball = ball_in_data(kBall_m, stretch);
  test::Random random(5);
  for (int round = 0; round < 20; ++round) {
    const glm::dvec3 along = glm::normalize(random.vector(1.0));
    const glm::dvec3 furthest = ball.data_from_ball * glm::normalize(along * ball.data_from_ball);
    EXPECT_NEAR(glm::length(stretch * furthest), kBall_m, 1e-15);
    EXPECT_NEAR(glm::dot(along, furthest), ball.reach_m(along), 1e-15);
    // No other place of the ball is further along.
    for (int other = 0; other < 20; ++other) {
      const glm::dvec3 place = ball.data_from_ball * glm::normalize(random.vector(1.0));
      EXPECT_LE(glm::dot(along, place), ball.reach_m(along) * (1.0 + 1e-12));
    }
  }
}

TEST(BallTool, HasARadiusThatIsANumber) {
  for (const double radius : {-0.001, std::nan("")}) {
    SceneSpec spec = scene_of(false, 1.0);
    spec.tool_radius_m = radius;
    const auto refused = plan(spec, {volume_of(kFloor)});
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("radius"), std::string::npos);
  }
}

}  // namespace
}  // namespace palpate
