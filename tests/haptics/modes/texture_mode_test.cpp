// The example of a texture. Oracle: Coulomb's law with the friction of the place where the proxy
// is, and the frequency of a stroke, v / wavelength.
#include "docs/examples/texture_mode.h"

#include <gtest/gtest.h>

#include "tests/haptics/shell_scene.h"

namespace palpate {
namespace {

constexpr double kWave_m = 0.002, kStroke_m_per_s = 0.05, kPressed_m = 0.002;
constexpr double kTextureSpring = 600.0;

/// 1000 below y = 0, 0 above.
class TexturedFloor final : public FrameData {
 public:
  bool is_vector() const noexcept override { return false; }
  double scalar(glm::dvec3 x) const noexcept override {
    return 500.0 * (1.0 - std::tanh(x.y / 0.5e-3));
  }
  glm::dvec3 scalar_gradient(glm::dvec3 x) const noexcept override {
    const double c = std::cosh(std::clamp(x.y / 0.5e-3, -20.0, 20.0));
    return {0.0, -500.0 / (0.5e-3 * c * c), 0.0};
  }
  glm::dvec3 vector(glm::dvec3 x) const noexcept override { return scalar_gradient(x); }
  glm::dmat3 vector_jacobian(glm::dvec3) const noexcept override { return glm::dmat3(0.0); }
  double detail_m() const noexcept override { return 1e-3; }
  glm::dvec3 low_m() const noexcept override { return glm::dvec3(-0.1); }
  glm::dvec3 high_m() const noexcept override { return glm::dvec3(0.1); }
};

std::shared_ptr<const MovingVolume> textured_floor() {
  auto volume = std::make_shared<MovingVolume>();
  volume->name = "shell";
  volume->times.times_s = {0.0};
  volume->frames = {std::make_shared<TexturedFloor>()};
  return volume;
}

SceneSpec textured() {
  SceneSpec spec = test::shell_spec(5.0, 0.3, kTextureSpring);
  spec.modes[0].kind = "texture";
  spec.modes[0].gain = 0.9;
  spec.modes[0].range_m = kWave_m;
  return spec;
}

TEST(TexturedSurface, VibratesWithTheSpeedOfAStrokeOverTheWavelength) {
  ModeKinds kinds;
  add_texture(kinds);
  const auto scene = plan(textured(), {textured_floor()}, kinds);
  ASSERT_TRUE(scene) << scene.error().message;
  Haptics haptics(test::unmetered(), test::Hand::device());
  haptics.adopt(Haptics::prepare(*scene));
  TickInput input;
  const auto tick = [&](double x, double y) {
    input.now_ns += 1'000'000;
    input.reading.time_ns = input.now_ns;
    input.reading.position_m = {x, y, 0.0};
    return haptics.tick(input);
  };
  for (int i = 0; i < 500; ++i) tick(0.0, 0.003 - (0.003 + kPressed_m) * i / 499.0);
  // A second of stroking; the first 100 ms are the way to sliding.
  const double normal_n = kTextureSpring * kPressed_m;
  double last = 0.0, read_at_m = 0.0;
  int rises = 0;
  for (int i = 0; i < 1100; ++i) {
    const TickOutput out = tick(1e-3 * kStroke_m_per_s * i, -kPressed_m);
    // A mode reads its data where the proxy is as the frame begins.
    const double wave = std::sin(2.0 * std::numbers::pi * read_at_m / kWave_m);
    read_at_m = out.proxy_m.x;
    if (i < 100) continue;
    const double friction = 0.3 * (1.0 + 0.9 * wave / 3.0);
    EXPECT_NEAR(-out.wanted_n.x, friction * normal_n, 1e-3 * normal_n) << i;
    const double beyond = -out.wanted_n.x - 0.3 * normal_n;
    rises += i > 100 && last < 0.0 && beyond >= 0.0;
    last = beyond;
  }
  EXPECT_NEAR(rises, kStroke_m_per_s / kWave_m, 1.0);
}

TEST(TexturedSurface, IsRefusedWithoutAWavelength) {
  ModeKinds kinds;
  add_texture(kinds);
  for (const auto& [gain, range_m] : {std::pair{0.5, 0.0}, std::pair{1.5, 0.002}}) {
    SceneSpec spec = textured();
    spec.modes[0].gain = gain;
    spec.modes[0].range_m = range_m;
    const auto scene = plan(spec, {textured_floor()}, kinds);
    ASSERT_FALSE(scene);
    EXPECT_NE(scene.error().message.find("range_m"), std::string::npos);
  }
}

}  // namespace
}  // namespace palpate
