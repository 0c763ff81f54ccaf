#include "integration/devices/falcon_kinematics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate::devices::falcon {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// Lengths in metres, in the letters of the loop equations.
constexpr double kA = 0.060, kB = 0.1025, kC = 0.01443, kDPlusE = 0.0225, kF = -0.025;
constexpr double kR = 0.040, kS = -0.02309;

// Azimuth of each leg: a third of a turn apart, the first at 90 degrees, all turned by 15.
const glm::dvec3 kCosAzimuth{std::cos(105 * kDegree), std::cos(-15 * kDegree),
                             std::cos(-135 * kDegree)};
const glm::dvec3 kSinAzimuth{std::sin(105 * kDegree), std::sin(-15 * kDegree),
                             std::sin(-135 * kDegree)};

// 320 slots, four edges each; the motor's drum turns the arm's sector by a cable.
constexpr double kArmAtZero = 35.0 * kDegree;
constexpr double kAnglePerCount = (360.0 / 1280.0) * (14.25 / 110.0) * kDegree;

constexpr double kCountsPerNewtonMetre = -10000.0;

// Of a sine, so dimensionless: nearer to a stretched leg than this, forces have no meaning.
constexpr double kStretched = 1e-6;

// Newton's error is squared by every step: after a step this short it is below 1e-14 m.
constexpr double kShortStep = 1e-8;
constexpr int kMostSteps = 30, kMostHalvings = 8;

bool all_finite(glm::dvec3 v) noexcept {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace

glm::dvec3 arm_angles(const std::array<int16_t, 3>& counts) noexcept {
  return kArmAtZero + kAnglePerCount * glm::dvec3(counts[0], counts[1], counts[2]);
}

glm::dvec3 encoder_counts(glm::dvec3 angles) noexcept {
  return (angles - kArmAtZero) / kAnglePerCount;
}

std::optional<Joints> inverse(glm::dvec3 position) noexcept {
  Joints joints;
  for (int leg = 0; leg < 3; ++leg) {
    const double cos_phi = kCosAzimuth[leg], sin_phi = kSinAzimuth[leg];
    const double u = position.x * cos_phi + position.y * sin_phi - kR;
    const double v = -position.x * sin_phi + position.y * cos_phi - kS;
    const double w = position.z;
    const double cos_th3 = (v + kF) / kB;
    if (!(std::abs(cos_th3) <= 1.0 && w > 0.0)) return {};  // also what is not a number
    const double length = kDPlusE + std::sqrt((1.0 - cos_th3) * (1.0 + cos_th3)) * kB;
    // |(u + c, w) - a (cos th1, sin th1)| = L, with t = tan(th1 / 2): l2 t^2 + l1 t + l0 = 0.
    const double reach = u + kC;
    const double both = w * w + reach * reach + kA * kA - length * length;
    const double l0 = both - 2.0 * kA * reach;
    const double l1 = -4.0 * kA * w;
    const double l2 = both + 2.0 * kA * reach;
    const double root = l1 * l1 - 4.0 * l0 * l2;
    if (!(root >= 0.0)) return {};
    // Of the two elbows the grip's is the one with the smaller angle. Written without the
    // difference of near numbers that the usual formula for a root has (-l1 > 0 above the base).
    joints.arm[leg] = 2.0 * std::atan2(2.0 * l0, -l1 + std::sqrt(root));
    joints.sideways[leg] = std::acos(cos_th3);
    joints.forearm[leg] =
        std::atan2(w - kA * std::sin(joints.arm[leg]), reach - kA * std::cos(joints.arm[leg]));
  }
  if (!all_finite(joints.arm)) return {};
  return joints;
}

std::optional<glm::dmat3> jacobian(const Joints& joints) noexcept {
  glm::dmat3 rows(0.0);
  for (int leg = 0; leg < 3; ++leg) {
    const double sin_th3 = std::sin(joints.sideways[leg]);
    const double bend = sin_th3 * std::sin(joints.arm[leg] - joints.forearm[leg]);
    if (!(std::abs(bend) > kStretched)) return {};
    const double per = -1.0 / (kA * bend);
    const double along = std::cos(joints.forearm[leg]) * sin_th3 * per;
    const double across = std::cos(joints.sideways[leg]) * per;
    const double up = std::sin(joints.forearm[leg]) * sin_th3 * per;
    rows[0][leg] = along * kCosAzimuth[leg] - across * kSinAzimuth[leg];
    rows[1][leg] = along * kSinAzimuth[leg] + across * kCosAzimuth[leg];
    rows[2][leg] = up;
  }
  return rows;
}

std::optional<Position> forward(glm::dvec3 angles, glm::dvec3 start) noexcept {
  if (!all_finite(angles)) return {};
  auto joints = inverse(start);
  if (!joints) {
    start = kWorkspaceCentre;
    joints = inverse(start);
  }
  Position at{start, 0};
  while (at.steps < kMostSteps) {
    const auto rows = jacobian(*joints);
    if (!rows) return {};
    glm::dvec3 step = glm::inverse(*rows) * (angles - joints->arm);
    ++at.steps;
    // A step that leaves the reach is shortened, since the arms' angles are not defined beyond it.
    auto next = inverse(at.metres + step);
    for (int cut = 0; !next && cut < kMostHalvings; ++cut) {
      step *= 0.5;
      next = inverse(at.metres + step);
    }
    if (!next) return {};
    at.metres += step;
    joints = next;
    if (glm::dot(step, step) < kShortStep * kShortStep) {
      // A cut step may be short far from a solution.
      const glm::dvec3 off = glm::abs(angles - joints->arm);
      if (std::max({off.x, off.y, off.z}) < 1e-9) return at;
    }
  }
  return {};
}

glm::dvec3 arm_torques(const glm::dmat3& jacobian, glm::dvec3 force_n) noexcept {
  return glm::transpose(glm::inverse(jacobian)) * force_n;
}

std::array<int16_t, 3> motor_counts(const glm::dmat3& jacobian, glm::dvec3 force_n) noexcept {
  glm::dvec3 counts = kCountsPerNewtonMetre * arm_torques(jacobian, force_n);
  if (!all_finite(counts)) return {};
  const glm::dvec3 size = glm::abs(counts);
  const double largest = std::max({size.x, size.y, size.z});
  if (largest > kMotorLimit) counts *= kMotorLimit / largest;
  std::array<int16_t, 3> rounded;
  for (int m = 0; m < 3; ++m) rounded[size_t(m)] = int16_t(std::lrint(counts[m]));
  return rounded;
}

glm::dvec3 force_of(const glm::dmat3& jacobian, const std::array<int16_t, 3>& counts) noexcept {
  return glm::transpose(jacobian) *
         (glm::dvec3(counts[0], counts[1], counts[2]) / kCountsPerNewtonMetre);
}

}  // namespace palpate::devices::falcon
