#include "module/haptics/proxy/balance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/haptics/proxy/balance_check.h"

namespace palpate {
namespace {

using Kind = Primitive::Kind;
using Vec = glm::dvec3;

constexpr double kStiffness = 1000.0;  // N/m: 1 N is 1 mm
/// Positions of some centimetres, a few operations each: some units of 2^-53 * 0.1 m.
constexpr double kRoundOffM = 1e-16;
/// The general solver ends below 1e-9 N; places have a round-off of 16 units in the last place.
constexpr double kSolvedM = 1e-9 / kStiffness + 1e-15;

PrimitiveSet set_of(std::initializer_list<Primitive> primitives) {
  PrimitiveSet result;
  for (const Primitive& p : primitives) EXPECT_TRUE(result.add(p));
  return result;
}

Primitive plane(Vec position, Vec q, double strength_n, double friction = 0.0) {
  return {Kind::kPlane, position, q, strength_n, friction};
}
Primitive line(Vec position, Vec q, double strength_n) {
  return {Kind::kLine, position, q, strength_n};
}
Primitive point(Vec position, double strength_n) {
  return {Kind::kPoint, position, {0.0, 0.0, 1.0}, strength_n};
}
Primitive force(Vec q, double strength_n) {
  return {Kind::kForce, {}, q, strength_n};
}

void expect_near(Vec got, Vec wanted, double tolerance, const char* what = "") {
  EXPECT_LE(glm::distance(got, wanted), tolerance)
      << what << ": got " << got.x << " " << got.y << " " << got.z << ", wanted " << wanted.x << " "
      << wanted.y << " " << wanted.z;
}

const Vec kX{1.0, 0.0, 0.0}, kY{0.0, 1.0, 0.0}, kZ{0.0, 0.0, 1.0};
const Vec kTilted = Vec(2.0, -1.0, 2.0) / 3.0;
const Vec kAcross = Vec(1.0, 2.0, 0.0) / std::sqrt(5.0);  // perpendicular to kTilted
const Vec kPlace{0.03, -0.02, 0.05};

TEST(Balance, LeavesTheProxyAtTheProbeWhenNothingHolds) {
  EXPECT_EQ(balance({}, kPlace, kStiffness).proxy, kPlace);
  const Vec front = kPlace + 0.01 * kTilted;
  const Balance free = balance(set_of({plane(kPlace, kTilted, 2.0, 0.5)}), front, kStiffness);
  EXPECT_EQ(free.proxy, front);
  EXPECT_EQ(free.iterations, 0);
}

TEST(Balance, AddsDirectedForces) {
  const auto set = set_of({force(kX, 2.0), force(-kY, 3.0), force(kX, 1.0)});
  expect_near(balance(set, kPlace, kStiffness).proxy, kPlace + Vec(0.003, -0.003, 0.0), kRoundOffM);
}

TEST(Balance, HoldsAtAPlaneUntilItsStrengthThenYields) {
  const auto set = set_of({plane(kPlace, kTilted, 2.0)});
  const Vec aside = 0.004 * kAcross;
  const Vec held = balance(set, kPlace - 0.0019 * kTilted + aside, kStiffness).proxy;
  expect_near(held, kPlace + aside, kRoundOffM);
  const Vec yielded = balance(set, kPlace - 0.005 * kTilted + aside, kStiffness).proxy;
  expect_near(yielded, kPlace + aside - 0.003 * kTilted, kRoundOffM);
}

TEST(Balance, PullsToALineAndToAPoint) {
  const auto along = set_of({line(kPlace, kTilted, 2.0)});
  expect_near(balance(along, kPlace + 0.01 * kTilted + 0.0019 * kAcross, kStiffness).proxy,
              kPlace + 0.01 * kTilted, kRoundOffM);
  expect_near(balance(along, kPlace + 0.01 * kTilted + 0.005 * kAcross, kStiffness).proxy,
              kPlace + 0.01 * kTilted + 0.003 * kAcross, kRoundOffM);
  const auto at = set_of({point(kPlace, 2.0)});
  expect_near(balance(at, kPlace + 0.0019 * kAcross, kStiffness).proxy, kPlace, 0.0);
  expect_near(balance(at, kPlace + 0.005 * kAcross, kStiffness).proxy, kPlace + 0.003 * kAcross,
              kRoundOffM);
}

TEST(Balance, SlidesWithFrictionTimesTheNormalForce) {
  const auto set = set_of({plane(kPlace, kTilted, 4.0, 0.5)});
  // 2 N of normal force, so at most 1 N of friction, which stretches the spring by 1 mm.
  const Vec pressed = kPlace - 0.002 * kTilted;
  expect_near(balance(set, pressed + 0.0009 * kAcross, kStiffness).proxy, kPlace, kRoundOffM);
  expect_near(balance(set, pressed + 0.003 * kAcross, kStiffness).proxy, kPlace + 0.002 * kAcross,
              kRoundOffM);
  // The spring needs 6 N, the plane gives 4 N: 2 N of friction.
  expect_near(balance(set, kPlace - 0.006 * kTilted + 0.003 * kAcross, kStiffness).proxy,
              kPlace - 0.002 * kTilted + 0.001 * kAcross, kRoundOffM);
}

TEST(Balance, HoldsFromBothSidesWithFriction) {
  const auto set = set_of({plane(kPlace, kTilted, 4.0, 0.5), plane(kPlace, -kTilted, 2.0, 1.0)});
  expect_near(balance(set, kPlace - 0.002 * kTilted + 0.003 * kAcross, kStiffness).proxy,
              kPlace + 0.002 * kAcross, kRoundOffM);
  expect_near(balance(set, kPlace + 0.003 * kTilted + 0.003 * kAcross, kStiffness).proxy,
              kPlace + 0.001 * kTilted + 0.001 * kAcross, kRoundOffM);
}

TEST(Balance, TreatsAPlaneAndALineOfOneDirectionApart) {
  const auto set = set_of({plane(kPlace, kTilted, 4.0), line(kPlace, -kTilted, 1.0)});
  const Balance result = balance(set, kPlace - 0.005 * kTilted + 0.003 * kAcross, kStiffness);
  expect_near(result.proxy, kPlace - 0.001 * kTilted + 0.002 * kAcross, kRoundOffM);
  EXPECT_EQ(result.iterations, 0);
}

TEST(Balance, RestsInTheCornerOfThreePlanesFarApart) {
  const auto set = set_of({plane({0.01, 0.5, -0.3}, kX, 4.0), plane({0.2, 0.02, 0.7}, kY, 4.0),
                           plane({-0.6, 0.1, 0.03}, kZ, 4.0)});
  const Balance result = balance(set, {0.008, 0.017, 0.024}, kStiffness);
  EXPECT_TRUE(result.converged);
  // The third plane gives 4 of 6 N.
  expect_near(result.proxy, {0.01, 0.02, 0.028}, kSolvedM);
}

TEST(Balance, SlidesIntoAnEdge) {
  // Two planes at 60 degrees, the probe straight below their edge: both planes carry a part of the
  // load.
  const double c = std::cos(0.5), s = std::sin(0.5);
  const auto set = set_of({plane(kPlace, {c, 0.0, s}, 3.0), plane(kPlace, {-c, 0.0, s}, 3.0)});
  expect_near(balance(set, kPlace - 0.001 * kZ + 0.002 * kY, kStiffness).proxy, kPlace + 0.002 * kY,
              kSolvedM);
  // The two give 6 N in total, of which the share sin(0.5) points upwards.
  expect_near(balance(set, kPlace - 0.01 * kZ, kStiffness).proxy, kPlace - (0.01 - 0.006 * s) * kZ,
              kSolvedM);
}

TEST(Balance, CrossesALineWithAPlane) {
  const auto set = set_of({line(kPlace, kX, 5.0), plane(kPlace + 0.01 * kX, kX, 5.0)});
  expect_near(balance(set, kPlace + 0.007 * kX + 0.002 * kY, kStiffness).proxy, kPlace + 0.01 * kX,
              kSolvedM);
}

TEST(Balance, TakesFrictionOfSeveralModesFromTheirOwnNormalForces) {
  // Floor and wall at a right angle, the hand pushed into both and along their edge: 2 N and 1 N
  // of normal force give 1 N and 0.2 N of friction along the edge; the rest slides.
  const auto set = set_of({plane(kPlace, kZ, 9.0, 0.5), plane(kPlace, kX, 9.0, 0.2)});
  const Balance result = balance(set, kPlace + Vec(-0.001, 0.004, -0.002), kStiffness);
  EXPECT_TRUE(result.converged);
  expect_near(result.proxy, kPlace + (0.004 - 0.001 - 0.0002) * kY, kSolvedM);
}

TEST(Balance, SharesFrictionOfRepeatedPlanesByStrength) {
  // One plane, given as a plane of 1 N and one of 3 N, pressed with 2 N: they carry 0.5 N and 1.5
  // N, with or without another primitive.
  const double friction_n = 0.5 * 0.8 + 1.5 * 0.4;
  for (const Primitive& other : {plane(kPlace, kTilted, 1e-30), plane(kPlace - kX, kX, 1.0)}) {
    const auto set =
        set_of({plane(kPlace, kTilted, 1.0, 0.8), plane(kPlace, kTilted, 3.0, 0.4), other});
    const Vec probe = kPlace - 0.002 * kTilted + 0.003 * kAcross;
    expect_near(balance(set, probe, kStiffness).proxy,
                kPlace + (0.003 - friction_n / kStiffness) * kAcross, 2.0 * kSolvedM);
  }
}

TEST(Balance, IsFiniteForEveryFiniteInput) {
  const double big = std::numeric_limits<double>::max();
  for (const double at : {0.0, 1e-300, 1e-30, 1.0, 1e30, 1e300, big})
    for (const double strength : {1e-300, 1.0, 1e300, big})
      for (const double stiffness : {1e-300, 1e-3, 1e3, 1e300})
        for (const Vec q : {Vec(0.0), kX, kTilted, 1e-300 * kX, 1e300 * kTilted}) {
          const auto set =
              set_of({plane(at * kX, q, strength, 0.5), line(-at * kY, q, strength),
                      point(at * kZ, strength), force(q, strength), plane(at * kZ, -q, strength)});
          for (int count = 1; count <= set.count(); ++count) {
            PrimitiveSet some;
            for (int i = 0; i < count; ++i) some.add(set[i]);
            const Vec got = balance(some, at * Vec(0.5, -1.0, 0.25), stiffness).proxy;
            EXPECT_TRUE(std::isfinite(got.x) && std::isfinite(got.y) && std::isfinite(got.z))
                << at << " " << strength << " " << stiffness << " " << count;
          }
        }
}

TEST(Balance, SaysWhenTheNumbersAreTooLarge) {
  const Balance result = balance(set_of({force(kX, 1e300)}), kPlace, 1e-300);
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.proxy, kPlace);
}

TEST(Balance, TheCheckOfTheTestsSeesAWrongProxy) {
  const auto set = set_of({plane(kPlace, kTilted, 2.0), line(kPlace, kX, 1.0)});
  const Vec probe = kPlace - 0.001 * kTilted;
  const Vec proxy = balance(set, probe, kStiffness).proxy;
  EXPECT_LE(test::residual_n(set, probe, kStiffness, proxy), 1e-9);
  // At 1 pm from the plane it gives no force, or its full force: neither balances the spring's 1 N.
  EXPECT_GT(test::residual_n(set, probe, kStiffness, proxy + 1e-12 * kTilted), 0.1);
  EXPECT_GT(test::residual_n(set, probe, kStiffness, proxy - 1e-12 * kTilted), 0.1);
}

}  // namespace
}  // namespace palpate
