// Viscosity. Oracle: the closed form of an implicit damper, F = b v, and the energy: nothing but
// the sampling of the hand may give it any.
#include <gtest/gtest.h>

#include "tests/haptics/shell_scene.h"
#include "tests/support/random.h"

namespace palpate {
namespace {

using namespace test;

/// One value everywhere, 20 cm wide.
class Thick final : public FrameData {
 public:
  bool is_vector() const noexcept override { return false; }
  double scalar(glm::dvec3) const noexcept override { return 1000.0; }
  glm::dvec3 scalar_gradient(glm::dvec3) const noexcept override { return glm::dvec3(0.0); }
  glm::dvec3 vector(glm::dvec3) const noexcept override { return glm::dvec3(0.0); }
  glm::dmat3 vector_jacobian(glm::dvec3) const noexcept override { return glm::dmat3(0.0); }
  double detail_m() const noexcept override { return 1e-3; }
  glm::dvec3 low_m() const noexcept override { return glm::dvec3(-0.1); }
  glm::dvec3 high_m() const noexcept override { return glm::dvec3(0.1); }
};

std::shared_ptr<const MovingVolume> thick() {
  auto volume = std::make_shared<MovingVolume>();
  volume->name = "shell";
  volume->times.times_s = {0.0};
  volume->frames = {std::make_shared<Thick>()};
  return volume;
}

SceneSpec thick_scene(double n_s_per_m, double stiffness_n_per_m = 600.0) {
  SceneSpec spec = shell_spec(6.0, 0.0, stiffness_n_per_m);
  spec.modes[0].name = spec.modes[0].kind = "viscosity";
  spec.modes[0].strength = TransferFunction::constant(n_s_per_m);
  return spec;
}

/// The scene of material that moves with the poses it is sent.
SceneSpec carried_scene(double n_s_per_m) {
  SceneSpec spec = thick_scene(n_s_per_m);
  spec.volumes[0].drive.kind = DriveSpec::Kind::kSecondHand;
  spec.volumes[0].path = PosePath::kExact;
  return spec;
}

void move_material(Hand& hand, glm::dvec3 to) {
  hand.input.poses[0].transform.translation_m = to;
  hand.input.poses[0].time_ns = hand.input.now_ns;
  hand.input.pose_count = 1;
}

const glm::dvec3 kWay_m_per_s{0.03, -0.05, 0.02};

TEST(Viscosity, IsItsCoefficientTimesTheVelocity) {
  for (const double b : {0.5, 2.0, 40.0}) {
    Hand hand(thick_scene(b), {thick()});
    TickOutput out;
    // 40 N s/m: a time constant of 67 ms.
    for (int i = 0; i < 2000; ++i) out = hand.to(1e-3 * i * kWay_m_per_s);
    EXPECT_LT(glm::length(out.wanted_n + b * kWay_m_per_s), 1e-6) << b;
    EXPECT_EQ(out.cause == Cause::kSudden, false);
  }
}

TEST(Viscosity, IsRelativeToMaterialThatMoves) {
  Hand hand(carried_scene(3.0), {thick()});
  TickOutput out;
  for (int i = 0; i < 1000; ++i) {
    move_material(hand, 1e-3 * i * kWay_m_per_s);
    out = hand.to(1e-3 * i * kWay_m_per_s);
    ASSERT_LT(glm::length(out.wanted_n), 1e-9) << "a hand that goes along feels nothing";
  }
  // A hand that stops feels the material that flows on.
  const glm::dvec3 rest = 0.999 * kWay_m_per_s;
  for (int i = 1000; i < 1800; ++i) {
    move_material(hand, 1e-3 * i * kWay_m_per_s);
    out = hand.to(rest);
  }
  EXPECT_LT(glm::length(out.wanted_n - 3.0 * kWay_m_per_s), 1e-6);
}

// k (p - x) = b (x - a) / dt in every tick, whatever the hand does: also where it stops at once,
// and that change of the force is the material's, not a sudden one of the scene.
TEST(Viscosity, IsExactlyImplicitInEveryTick) {
  constexpr double kStiffness = 600.0, kB = 3.0;
  Hand hand(thick_scene(kB, kStiffness), {thick()});
  glm::dvec3 last(0.0);
  for (int i = 0; i < 600; ++i) {
    const double t = 1e-3 * std::min(i, 400);
    const TickOutput out =
        hand.to(t * glm::dvec3(0.1, 0.0, 0.0) + glm::dvec3(0.0, 0.01 * std::sin(20.0 * t), 0.0));
    if (i > 0) {
      const glm::dvec3 damper = -kB * (out.proxy_m - last) / 1e-3;
      EXPECT_LT(glm::length(out.wanted_n - damper), 1e-9) << i;
    }
    EXPECT_NE(out.cause, Cause::kSudden) << i;
    last = out.proxy_m;
  }
}

TEST(Viscosity, GivesNoEnergyAtAnyStepSizeAndCoefficient) {
  test::Random random(7);
  for (int round = 0; round < 30; ++round) {
    const double b = std::pow(10.0, random.draw(-2.0, 3.0));
    const double k = std::pow(10.0, random.draw(2.0, 3.7));
    HapticsOptions options;
    options.lead = false;
    Hand hand(thick_scene(b, k), {thick()}, options);
    glm::dvec3 at(0.0), velocity(0.0), force(0.0);
    double work_j = 0.0, sampling_j = 0.0;
    for (int i = 0; i < 400; ++i) {
      velocity = 0.95 * velocity + random.vector(0.05);
      const double dt = random.draw(2e-4, 4e-3);
      const glm::dvec3 moved = dt * velocity;
      at += moved;
      hand.input.now_ns += int64_t(1e9 * dt) - 1'000'000;
      const TickOutput out = [&] {
        hand.input.now_ns += 1'000'000;
        hand.input.dt_s = dt;
        hand.input.reading.position_m = at;
        hand.input.reading.time_ns = hand.input.now_ns;
        hand.input.reading.fresh = true;
        return hand.haptics.tick(hand.input);
      }();
      work_j += glm::dot(force, moved);
      sampling_j += 0.5 * k * glm::dot(moved, moved);
      force = out.wanted_n;
      ASSERT_LE(work_j, sampling_j + 1e-12) << "b " << b << ", k " << k << ", tick " << i;
    }
    EXPECT_LT(hand.haptics.tank().ledger().put_in_j, 1e-12) << "b " << b << ", k " << k;
    EXPECT_LT(work_j, 0.0);
  }
}

// Other primitives share the balance: on a wall the damper only acts along it.
TEST(Viscosity, LeavesAWallAsItIs) {
  auto data = shell(1, 1.0);
  SceneSpec spec = shell_spec(6.0, 0.0, 600.0);
  spec.modes.push_back(spec.modes[0]);
  spec.modes[1].name = spec.modes[1].kind = "viscosity";
  spec.modes[1].strength = TransferFunction::constant(2.0);
  Hand hand(spec, {data});
  const double radius_m = 1e-3 * kOuterMm;
  TickOutput out;
  for (int i = 0; i < 1000; ++i) out = hand.to({radius_m + 0.01 - 1e-5 * i, 0.0, 0.0});
  for (int i = 0; i < 300; ++i) out = hand.to({radius_m - 0.002, 0.0, 0.0});
  EXPECT_NEAR(out.wanted_n.x, 600.0 * 0.002, 0.01);
  // Away from the wall: no slower than through the material.
  for (int i = 0; i < 300; ++i) out = hand.to({radius_m - 0.002 + 1e-4 * i, 0.0, 0.0});
  EXPECT_NEAR(out.wanted_n.x, -2.0 * 0.1, 1e-6);
}

}  // namespace
}  // namespace palpate
