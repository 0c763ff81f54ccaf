#include "module/haptics/proxy/haptics.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/haptics/shell_scene.h"

namespace palpate {
namespace {

using namespace test;

// N/m; 1 um is 0.6 mN.
constexpr double kStiffness = 600.0;
// The method's own error: contact is found to 0.2 um, and a field sampled at 1 mm has an error of 3
// um between samples.
constexpr double kMethod_n = 0.005;
// With data sampled at 1 mm: the spline's smoothing moves the surface of a ball of 25 mm in by 13
// um, and sampling tilts its normals by 0.01 rad.
constexpr double kSampled_n = 0.02;

/// Errors of a force against an exact one.
struct Errors {
  double worst = 0.0, squares = 0.0;
  int count = 0;
  void add(glm::dvec3 error) {
    worst = std::max(worst, glm::length(error));
    squares += glm::dot(error, error);
    ++count;
  }
  double rms() const { return std::sqrt(squares / count); }
  void tell(const char* what) const {
    std::printf("%s: RMS %.5f N, max %.5f N\n", what, rms(), worst);
  }
};

TEST(Haptics, GivesNoForceInFreeSpace) {
  Hand hand(shell_spec(5.0, 0.0, kStiffness), {shell(1, 1.0)});
  for (int i = 0; i < 100; ++i) {
    const TickOutput out = hand.to({0.04, 1e-4 * i, 0.0});
    EXPECT_EQ(glm::length(out.wanted_n), 0.0);
    EXPECT_EQ(out.proxy_m, out.probe_m);
  }
}

TEST(Haptics, PressesBackAsTheSphereDoes) {
  for (const Made made : {Made::kAnalytic, Made::kSampled}) {
    Hand hand(shell_spec(5.0, 0.0, kStiffness), {shell(1, 1.0, made)});
    Errors errors;
    // From outside to 4 mm deep at 20 mm/s, not along an axis.
    const glm::dvec3 dir = glm::normalize(glm::dvec3(0.6, 0.5, -0.4));
    for (int i = 0; i < 500; ++i) {
      const double r = 0.031 - 20e-6 * i;
      const double exact = kStiffness * std::max(0.0, 1e-3 * kOuterMm - r);
      errors.add(hand.to(r * dir).wanted_n - exact * dir);
    }
    errors.tell(made == Made::kAnalytic ? "press, analytic" : "press, sampled");
    EXPECT_LT(errors.worst, made == Made::kAnalytic ? kMethod_n : kSampled_n);
  }
}

TEST(Haptics, SlidesWithoutDiggingInOrTakingOff) {
  for (const Made made : {Made::kAnalytic, Made::kSampled}) {
    Hand hand(shell_spec(5.0, 0.0, kStiffness), {shell(1, 1.0, made)});
    Errors errors;
    // Around the sphere, 2 mm below its surface, at 100 mm/s.
    for (int i = 0; i < 3000; ++i) {
      const double angle = 0.1 * 1e-3 * i / 0.025, r = i < 200 ? 0.027 - 2e-5 * i : 0.023;
      const glm::dvec3 dir(std::cos(angle), std::sin(angle) * 0.8, std::sin(angle) * 0.6);
      const double exact = kStiffness * std::max(0.0, 1e-3 * kOuterMm - r);
      errors.add(hand.to(r * dir).wanted_n - exact * dir);
    }
    errors.tell(made == Made::kAnalytic ? "slide, analytic" : "slide, sampled");
    EXPECT_LT(errors.worst, made == Made::kAnalytic ? kMethod_n : kSampled_n);
  }
}

TEST(Haptics, SlidesInsideAHollowAsWell) {
  // The wall holds a hand that leaves: the hand is inside the ball and presses outwards, on a
  // concave wall.
  SceneSpec spec = shell_spec(5.0, 0.0, kStiffness);
  spec.modes[0].leaving = true;
  spec.modes[0].strength = *TransferFunction::stepped({0.0, 500.0}, {5.0, 0.0});
  Hand hand(spec, {shell(1, 1.0)});
  Errors errors;
  for (int i = 0; i < 3000; ++i) {
    const double angle = 0.1 * 1e-3 * i / 0.025, r = i < 200 ? 0.023 + 2e-5 * i : 0.027;
    const glm::dvec3 dir(std::cos(angle), std::sin(angle) * 0.8, std::sin(angle) * 0.6);
    const double exact = kStiffness * std::max(0.0, r - 1e-3 * kOuterMm);
    errors.add(hand.to(r * dir).wanted_n + exact * dir);
  }
  errors.tell("slide in a hollow");
  EXPECT_LT(errors.worst, kMethod_n);
}

TEST(Haptics, YieldsAtItsStrengthAndHoldsAgainWhereTheStrengthGrows) {
  // The strength grows from 0 to 2 N over 2 mm: the proxy stops where it equals the spring.
  SceneSpec spec = shell_spec(2.0, 0.0, kStiffness);
  const auto data = std::make_shared<MovingVolume>(*shell(1, 1.0));
  auto soft = std::make_shared<MovingVolume>(*data);
  soft->frames = {std::make_shared<Ball>(0.025, 0.004)};
  const double low = soft->frames[0]->scalar({0.026, 0.0, 0.0}),
               high = soft->frames[0]->scalar({0.024, 0.0, 0.0});
  spec.modes[0].strength = *TransferFunction::linear({low, high}, {0.0, 2.0});
  Hand hand(spec, {soft});
  const TransferFunction& tau = spec.modes[0].strength;
  for (int i = 0; i < 400; ++i) {
    const double probe = 0.027 - 1e-5 * i;
    const TickOutput out = hand.to({probe, 0.0, 0.0});
    if (probe > 0.026) continue;
    // Where k (x - probe) = tau(L(x)), by bisection.
    double in = 0.024, outside = 0.026;
    for (int b = 0; b < 60; ++b) {
      const double x = 0.5 * (in + outside);
      (kStiffness * (x - probe) < tau(soft->frames[0]->scalar({x, 0.0, 0.0})) ? in : outside) = x;
    }
    const double exact = std::max(0.0, std::min(kStiffness * (in - probe), 2.0));
    ASSERT_NEAR(out.wanted_n.x, exact, kMethod_n) << "probe at " << probe;
  }
}

TEST(Haptics, FollowsTheBeatingShell) {
  for (const Made made : {Made::kAnalytic, Made::kSampled})
    for (const double fps : {1.0, 2.0, 4.0}) {
      Hand hand(shell_spec(20.0, 0.0, kStiffness), {shell(4, fps, made)});
      Errors errors;
      for (int i = 0; i < 4000; ++i) {
        const double angle = 0.05 * 1e-3 * i / 0.03;
        const glm::dvec3 dir(std::cos(angle), std::sin(angle) * 0.8, std::sin(angle) * 0.6);
        const double r = 0.0305 + 0.006 * std::cos(7.0 * 1e-3 * i);
        const TickOutput out = hand.to(r * dir);
        const double exact = kStiffness * std::max(0.0, shell_radius_m(out.first, 4) - r);
        errors.add(out.wanted_n - exact * dir);
        ASSERT_FALSE(out.frozen) << "tick " << i;
        ASSERT_LT(out.residual_m, 1e-6);
      }
      errors.tell(made == Made::kAnalytic ? "beating, analytic" : "beating, sampled");
      EXPECT_LT(errors.rms(), made == Made::kAnalytic ? kMethod_n : kSampled_n) << fps;
    }
}

}  // namespace
}  // namespace palpate
