// The Falcon's geometry compared with numeric derivatives, its own closed form, and published
// numbers of the device.
#include "integration/devices/falcon_kinematics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/random.h"

namespace palpate::devices::falcon {
namespace {

using test::Random;

// The closed form cancels lengths of 0.1 m in doubles: a few 1e-16 m, times a condition number of
// about ten.
constexpr double kRoundTrip = 1e-12;

/// A random place in the largest sphere that the grip can reach, edge included.
glm::dvec3 reachable(Random& random) {
  while (true) {
    const glm::dvec3 p = random.vector(1.0);
    if (glm::dot(p, p) <= 1.0) return kWorkspaceCentre + kWorkspaceRadius * p;
  }
}

std::ostream& where(std::ostream& out, glm::dvec3 p) {
  return out << "at " << p.x << " " << p.y << " " << p.z;
}

struct At {
  glm::dvec3 p;
  friend std::ostream& operator<<(std::ostream& out, const At& at) { return where(out, at.p); }
};

/// The three loop equations of a leg, by their definition.
double loop_error(glm::dvec3 p, const Joints& joints) {
  const double degree = std::acos(-1.0) / 180.0;
  const double azimuth[3] = {105 * degree, -15 * degree, -135 * degree};
  double worst = 0.0;
  for (int leg = 0; leg < 3; ++leg) {
    const double u = p.x * std::cos(azimuth[leg]) + p.y * std::sin(azimuth[leg]) - 0.040;
    const double v = -p.x * std::sin(azimuth[leg]) + p.y * std::cos(azimuth[leg]) + 0.02309;
    const double length = 0.01125 + 0.01125 + 0.1025 * std::sin(joints.sideways[leg]);
    const double th1 = joints.arm[leg], th2 = joints.forearm[leg];
    worst = std::max(worst, std::abs(u + 0.01443 - 0.060 * std::cos(th1) - length * std::cos(th2)));
    worst = std::max(worst, std::abs(v - 0.025 - 0.1025 * std::cos(joints.sideways[leg])));
    worst = std::max(worst, std::abs(p.z - 0.060 * std::sin(th1) - length * std::sin(th2)));
  }
  return worst;
}

TEST(FalconKinematics, InverseClosesTheLoopOfEveryLeg) {
  Random random(11);
  for (int n = 0; n < 20000; ++n) {
    const glm::dvec3 p = reachable(random);
    const auto joints = inverse(p);
    ASSERT_TRUE(joints) << At{p};
    // A hundred roundings of 0.1 m.
    ASSERT_LT(loop_error(p, *joints), 1e-15 * 100) << At{p};
  }
}

TEST(FalconKinematics, JacobianIsTheDerivativeOfTheArms) {
  Random random(12);
  // Central differences over h: an error of h^2 times a third derivative of up to a few 1e5
  // rad/m^3, and rounding 1e-16 / h.
  constexpr double kStep = 1e-6, kDerivative = 1e-6;
  for (int n = 0; n < 5000; ++n) {
    const glm::dvec3 p = reachable(random) * 0.999 + kWorkspaceCentre * 0.001;
    const auto rows = jacobian(*inverse(p));
    ASSERT_TRUE(rows) << At{p};
    for (int axis = 0; axis < 3; ++axis) {
      glm::dvec3 h(0.0);
      h[axis] = kStep;
      const auto after = inverse(p + h), before = inverse(p - h);
      ASSERT_TRUE(after && before) << At{p};
      const glm::dvec3 numeric = (after->arm - before->arm) / (2.0 * kStep);
      for (int leg = 0; leg < 3; ++leg)
        ASSERT_NEAR((*rows)[axis][leg], numeric[leg], kDerivative * glm::length(numeric))
            << "leg " << leg << " axis " << axis << " " << At{p};
    }
  }
}

TEST(FalconKinematics, JacobianHasTheKnownAxialColumn) {
  // At (10, 5, 120) mm the first leg's column of z is 13.43 rad/m, not 10.50, which a widely copied
  // formula gives.
  const auto rows = jacobian(*inverse({0.010, 0.005, 0.120}));
  ASSERT_TRUE(rows);
  // Published with two decimals.
  EXPECT_NEAR(glm::abs((*rows)[2][0]), 13.43, 0.005);
}

TEST(FalconKinematics, ForwardReturnsFromInverseOverTheWholeWorkspace) {
  Random random(13);
  for (int n = 0; n < 20000; ++n) {
    const glm::dvec3 p = reachable(random);
    const auto there = forward(inverse(p)->arm, kWorkspaceCentre);
    ASSERT_TRUE(there) << At{p};
    ASSERT_LT(glm::distance(there->metres, p), kRoundTrip) << At{p};
  }
}

TEST(FalconKinematics, ForwardTakesFiveStepsWhenTheGripMovesAtAMetrePerSecond) {
  Random random(14);
  int most = 0;
  for (int n = 0; n < 20000; ++n) {
    const glm::dvec3 from = reachable(random);
    glm::dvec3 direction = random.vector(1.0);
    direction = glm::normalize(direction + glm::dvec3(1e-9));
    const glm::dvec3 to = from + 1e-3 * direction;
    const auto joints = inverse(to);
    if (!joints) continue;
    const auto there = forward(joints->arm, from);
    ASSERT_TRUE(there) << At{from};
    ASSERT_LT(glm::distance(there->metres, to), kRoundTrip) << At{from};
    most = std::max(most, there->steps);
  }
  EXPECT_LE(most, 5);
  EXPECT_GE(most, 2) << "one step can not reach 1e-12 m from a millimetre away";
}

TEST(FalconKinematics, AgreesWithTheKnownCountsOnTheAxis) {
  // z of 75 to 180 mm corresponds to counts of -1463 to 1309, to the nearest count.
  EXPECT_NEAR(encoder_counts(inverse({0, 0, 0.075})->arm).x, -1463, 0.5);
  EXPECT_NEAR(encoder_counts(inverse({0, 0, 0.180})->arm).x, 1309, 0.5);
}

TEST(FalconKinematics, HasTheKnownResolution) {
  const double z_mm[] = {90, 110, 130, 150}, um[] = {29, 38, 44, 48};
  for (int k = 0; k < 4; ++k) {
    const glm::dvec3 p{0, 0, 1e-3 * z_mm[k]};
    const double per_count = arm_angles({1, 0, 0}).x - arm_angles({0, 0, 0}).x;
    const double metres = per_count * glm::length(glm::inverse(*jacobian(*inverse(p)))[0]);
    // Published to a micrometre.
    EXPECT_NEAR(1e6 * metres, um[k], 0.6) << z_mm[k];
  }
}

/// The largest force along a direction at which no motor reaches its limit.
double largest_force(const glm::dmat3& rows, glm::dvec3 direction) {
  const glm::dvec3 torque = glm::abs(arm_torques(rows, direction));
  return 0.4096 / std::max({torque.x, torque.y, torque.z});  // 4096 counts at 10,000 per N m
}

TEST(FalconKinematics, HasTheKnownForcesAtTheMotorsLimit) {
  const double z_mm[] = {90, 110, 130, 150};
  const double axial[] = {20.8, 16.9, 16.3, 18.0}, lateral[] = {10.1, 7.8, 6.5, 5.8};
  for (int k = 0; k < 4; ++k) {
    const auto rows = jacobian(*inverse({0, 0, 1e-3 * z_mm[k]}));
    EXPECT_NEAR(largest_force(*rows, {0, 0, 1}), axial[k], 0.06) << z_mm[k];
    const double least = std::min(largest_force(*rows, {1, 0, 0}), largest_force(*rows, {0, 1, 0}));
    // Published to a tenth.
    EXPECT_NEAR(least, lateral[k], 0.06) << z_mm[k];
  }
}

TEST(FalconKinematics, GivesItsForceInEveryDirectionEverywhere) {
  Random random(18);
  double least = 1e9;
  for (int n = 0; n < 20000; ++n) {
    // The weakest places are at the edge.
    const glm::dvec3 p =
        kWorkspaceCentre + kWorkspaceRadius * glm::normalize(random.vector(1.0) + glm::dvec3(1e-9));
    // The torque of arm m is column m of the inverse times the force: largest along that column.
    const glm::dmat3 inverse_rows = glm::inverse(*jacobian(*inverse(p)));
    for (int m = 0; m < 3; ++m) least = std::min(least, 0.4096 / glm::length(inverse_rows[m]));
  }
  EXPECT_GE(least, kForceEverywhere);
  // Within the resolution of 20,000 random places.
  EXPECT_LT(least, 1.01 * kForceEverywhere);
}

TEST(FalconKinematics, TorquesDoTheWorkOfTheForce) {
  Random random(15);
  for (int n = 0; n < 5000; ++n) {
    const glm::dvec3 p = reachable(random), force = random.vector(8.0), dp = random.vector(1.0);
    const auto rows = jacobian(*inverse(p));
    const double work = glm::dot(force, dp);
    const double motors = glm::dot(arm_torques(*rows, force), *rows * dp);
    ASSERT_NEAR(motors, work, 1e-12 * (1.0 + glm::length(force) * glm::length(dp))) << At{p};
  }
}

TEST(FalconKinematics, MotorCountsMakeTheForceAndKeepItsDirectionAtTheLimit) {
  Random random(16);
  for (int n = 0; n < 5000; ++n) {
    const glm::dvec3 p = reachable(random), force = random.vector(40.0);
    const auto rows = jacobian(*inverse(p));
    const auto counts = motor_counts(*rows, force);
    int largest = 0;
    for (const int16_t count : counts) largest = std::max(largest, std::abs(int(count)));
    ASSERT_LE(largest, kMotorLimit) << At{p};
    const glm::dvec3 made = force_of(*rows, counts);
    const double share = std::min(1.0, glm::length(made) / glm::length(force));
    // Half a count per motor is 5e-5 N m; the Jacobian has up to 35 rad/m per arm.
    ASSERT_LT(glm::distance(made, share * force), 3 * 5e-5 * 35.0) << At{p};
    if (largest < kMotorLimit - 1) {
      ASSERT_NEAR(share, 1.0, 0.01 / glm::length(force)) << At{p};
    }
  }
}

TEST(FalconKinematics, PushesTheHandWhereTheForcePoints) {
  // A positive count must turn an arm towards smaller angles, which pulls the grip in.
  const auto rows = jacobian(*inverse(kWorkspaceCentre));
  for (const int16_t count : motor_counts(*rows, {0, 0, 1})) EXPECT_LT(count, 0);
  for (const int16_t count : motor_counts(*rows, {0, 0, -1})) EXPECT_GT(count, 0);
}

TEST(FalconKinematics, SaysOutOfReachAndNeverNotANumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const glm::dvec3 p : {glm::dvec3(0, 0, 1), glm::dvec3(0.5, 0, 0.13), glm::dvec3(0, -9, 0),
                             glm::dvec3(nan, 0, 0.13), glm::dvec3(0, 0, inf)})
    EXPECT_FALSE(inverse(p)) << At{p};
  EXPECT_FALSE(forward(glm::dvec3(nan), kWorkspaceCentre));
  EXPECT_FALSE(forward({0.6, 0.6, inf}, kWorkspaceCentre));
  EXPECT_TRUE(forward(arm_angles({0, 0, 0}), glm::dvec3(nan)))
      << "an invalid start must have no effect";
  const auto rows = jacobian(*inverse(kWorkspaceCentre));
  EXPECT_EQ(motor_counts(*rows, glm::dvec3(nan)), (std::array<int16_t, 3>{}));
  EXPECT_EQ(motor_counts(*rows, glm::dvec3(inf, 0, 0)), (std::array<int16_t, 3>{}));
}

TEST(FalconKinematics, AnyCountsGiveAPlaceThatFitsOrNone) {
  Random random(17);
  int places = 0;
  for (int n = 0; n < 50000; ++n) {
    std::array<int16_t, 3> counts;
    // Half of the counts are near the grip's range, half are anything.
    const double reach = n % 2 ? 32768.0 : 2000.0;
    for (int16_t& count : counts) count = int16_t(random.draw(-reach, reach));
    const auto place = forward(arm_angles(counts), kWorkspaceCentre);
    if (!place) continue;
    ++places;
    const auto joints = inverse(place->metres);
    ASSERT_TRUE(joints);
    const glm::dvec3 off =
        glm::abs(encoder_counts(joints->arm) - glm::dvec3(counts[0], counts[1], counts[2]));
    ASSERT_LT(std::max({off.x, off.y, off.z}), 1e-5)
        << counts[0] << " " << counts[1] << " " << counts[2];
  }
  EXPECT_GT(places, 1000);
}

}  // namespace
}  // namespace palpate::devices::falcon
