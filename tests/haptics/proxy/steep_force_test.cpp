// Forces from the data that change faster along the way than the spring's: the proxy comes to rest
// where they balance, in every tick.
#include <gtest/gtest.h>

#include "tests/haptics/shell_scene.h"

namespace palpate {
namespace {

using namespace test;

constexpr double kSteepStiffness = 600.0;
// The largest force of a force mode.
constexpr double kMost_n = 4.0;

/// The force is f = slope x per axis. With a negative slope it is a well, however steep.
class Well final : public FrameData {
 public:
  explicit Well(glm::dvec3 slope_n_per_m) : slope_(slope_n_per_m) {}
  bool is_vector() const noexcept override { return true; }
  double scalar(glm::dvec3 x) const noexcept override { return glm::length(vector(x)); }
  glm::dvec3 scalar_gradient(glm::dvec3) const noexcept override { return glm::dvec3(0.0); }
  glm::dvec3 vector(glm::dvec3 x) const noexcept override { return slope_ * x; }
  glm::dmat3 vector_jacobian(glm::dvec3) const noexcept override {
    return glm::dmat3(slope_.x, 0, 0, 0, slope_.y, 0, 0, 0, slope_.z);
  }
  double detail_m() const noexcept override { return 1e-3; }
  glm::dvec3 low_m() const noexcept override { return glm::dvec3(-0.05); }
  glm::dvec3 high_m() const noexcept override { return glm::dvec3(0.05); }

 private:
  glm::dvec3 slope_;
};

/// Pushes with kMost_n towards the plane x = 0 from both sides; the change takes a tenth of a
/// voxel.
class Gutter final : public FrameData {
 public:
  bool is_vector() const noexcept override { return true; }
  double scalar(glm::dvec3 x) const noexcept override { return glm::length(vector(x)); }
  glm::dvec3 scalar_gradient(glm::dvec3) const noexcept override { return glm::dvec3(0.0); }
  glm::dvec3 vector(glm::dvec3 x) const noexcept override {
    return {-kMost_n * std::tanh(x.x / 0.05e-3), 0.0, 0.0};
  }
  glm::dmat3 vector_jacobian(glm::dvec3) const noexcept override { return glm::dmat3(0.0); }
  double detail_m() const noexcept override { return 1e-3; }
  glm::dvec3 low_m() const noexcept override { return glm::dvec3(-0.05); }
  glm::dvec3 high_m() const noexcept override { return glm::dvec3(0.05); }
};

Hand pushed_by(std::shared_ptr<const FrameData> data) {
  auto volume = std::make_shared<MovingVolume>();
  volume->name = "field";
  volume->frames = {std::move(data)};
  volume->times.times_s = {0.0};
  SceneSpec spec = shell_spec(1.0, 0.0, kSteepStiffness);
  spec.volumes[0].name = "field";
  ModeSpec& mode = spec.modes[0];
  mode.volume = "field";
  mode.kind = "vector-force";
  mode.friction = TransferFunction();
  mode.strength = TransferFunction::constant(kMost_n);
  return Hand(spec, {volume});
}

TEST(SteepForce, OfAWellBalancesTheSpringWhateverItsSteepness) {
  const glm::dvec3 hand_at(1.7e-3, -1.1e-3, 0.6e-3);
  for (const glm::dvec3 times : {glm::dvec3(0.5), glm::dvec3(1.5), glm::dvec3(5.0),
                                 glm::dvec3(30.0), glm::dvec3(0.2, 3.0, 12.0)}) {
    const glm::dvec3 slope = -times * kSteepStiffness;
    Hand hand = pushed_by(std::make_shared<Well>(slope));
    // k (probe - proxy) + slope proxy = 0.
    const glm::dvec3 proxy = kSteepStiffness * hand_at / (glm::dvec3(kSteepStiffness) - slope);
    const glm::dvec3 force = kSteepStiffness * (proxy - hand_at);
    ASSERT_LT(glm::length(force), kMost_n);
    for (int tick = 0; tick < 60; ++tick) {
      const glm::dvec3 wanted = hand.to(hand_at).wanted_n;
      // At rest within ten frames, and then without vibration. Moves shorter than half a micrometre
      // are not corrected; such a move changes the force by slope times its length at most.
      const double rest = 0.5e-6 * std::max({slope.x, slope.y, slope.z, kSteepStiffness, -slope.x,
                                             -slope.y, -slope.z});
      if (tick >= 10) {
        EXPECT_LT(glm::distance(wanted, force), rest)
            << "times " << times.x << ' ' << times.y << ' ' << times.z << " tick " << tick;
      }
    }
  }
}

TEST(SteepForce, FollowsAHandThatMovesThroughAWell) {
  const glm::dvec3 slope(-6.0 * kSteepStiffness);
  Hand hand = pushed_by(std::make_shared<Well>(slope));
  glm::dvec3 last(0.0);
  for (int tick = 0; tick < 2000; ++tick) {
    const double t = 1e-3 * tick;
    const glm::dvec3 at = 1.2e-3 * glm::dvec3(std::sin(6.0 * t), std::cos(9.0 * t), 0.3);
    const glm::dvec3 wanted = hand.to(at).wanted_n;
    const glm::dvec3 exact =
        kSteepStiffness * (kSteepStiffness * at / (glm::dvec3(kSteepStiffness) - slope) - at);
    if (tick > 10) {
      EXPECT_LT(glm::distance(wanted, exact), 0.002) << "tick " << tick;
    }
    last = wanted;
  }
}

TEST(SteepForce, HoldsTheHandInAGutterOfATenthOfAVoxelWithoutAHum) {
  Hand hand = pushed_by(std::make_shared<Gutter>());
  glm::dvec3 before(0.0);
  double hum = 0.0;
  for (int tick = 0; tick < 400; ++tick) {
    // 4 mm to the side of the plane: 2.4 N of the spring, which the gutter can hold.
    const double x = std::min(4e-3, 2e-5 * tick);
    const glm::dvec3 wanted = hand.to({x, 0.0, 0.0}).wanted_n;
    if (tick > 210) {
      hum = std::max(hum, glm::distance(wanted, before));
      // The proxy is at rest where tanh gives 0.6: 0.035 mm beside the middle.
      const double proxy = 0.05e-3 * std::atanh(kSteepStiffness * (4e-3 - 0.035e-3) / kMost_n);
      EXPECT_NEAR(wanted.x, -kSteepStiffness * (4e-3 - proxy), 0.03) << "tick " << tick;
    }
    before = wanted;
  }
  EXPECT_LT(hum, 0.02);
}

}  // namespace
}  // namespace palpate
