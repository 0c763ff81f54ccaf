#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

namespace palpate::devices::falcon {

/// The Falcon's three legs hold the grip on parallelograms (a delta after Tsai and Stamper). Space:
/// the device's own, metres, x right, y up, z towards the user. Per leg, with the point turned into
/// the leg's plane (u, v, w): u + c = a cos th1 + L cos th2, v + f = b cos th3,
/// w = a sin th1 + L sin th2, L = d + e + b sin th3. Angles in radians. All functions here are pure
/// and real-time safe; what is not finite is out of reach.

/// The largest sphere the grip can reach.
inline constexpr glm::dvec3 kWorkspaceCentre{0.0, 0.0, 0.130};
inline constexpr double kWorkspaceRadius = 0.050;

/// Torque of a motor is an integer up to this, from the comment that comes with the constants.
inline constexpr int kMotorLimit = 4096;

/// Force in newtons that the motors can make in every direction everywhere in that sphere; in most
/// of it and along z they make several times more.
inline constexpr double kForceEverywhere = 4.38;

/// How far the grip moves for one count of one encoder at the centre.
inline constexpr double kResolutionAtCentre = 44.2e-6;

/// The angles of the three legs.
struct Joints {
  glm::dvec3 arm{0.0};       ///< th1: of the driven arm, the one the encoder sees
  glm::dvec3 forearm{0.0};   ///< th2: of the parallelogram in the leg's plane
  glm::dvec3 sideways{0.0};  ///< th3: of the parallelogram out of it
};

/// Angles of the arms for encoder counts, and the (fractional) counts for angles.
glm::dvec3 arm_angles(const std::array<int16_t, 3>& counts) noexcept;
glm::dvec3 encoder_counts(glm::dvec3 arm_angles) noexcept;

/// The angles that put the grip at a position in closed form; nothing if a leg can not reach it.
std::optional<Joints> inverse(glm::dvec3 position) noexcept;

/// d(arm angle) / d(position), rad/m, one row per leg (GLM: matrix[column][row]). Nothing where an
/// arm is in line with its forearm: there the motor holds no force.
std::optional<glm::dmat3> jacobian(const Joints& joints) noexcept;

/// Where the grip is.
struct Position {
  glm::dvec3 metres{0.0};
  int steps = 0;  ///< of Newton's method
};

/// The position at given arm angles, by Newton's method from `start`, to the rounding of doubles
/// (better than 1e-12 m); nothing if the arms can not stand so. From the last position of a grip
/// that moves at up to 1 m/s, asked for every millisecond, it takes 5 steps at most.
std::optional<Position> forward(glm::dvec3 arm_angles, glm::dvec3 start) noexcept;

/// Torques of the arms, N m, that put a force on the hand at a position with this Jacobian: the
/// work done is the same, torque . d(angle) = force . d(position). Not finite where the Jacobian is
/// singular.
glm::dvec3 arm_torques(const glm::dmat3& jacobian, glm::dvec3 force_n) noexcept;

/// Motor counts for a force on the hand. If one motor would pass its limit all three are made
/// smaller together, which keeps the force's direction. Zero if anything is not finite.
std::array<int16_t, 3> motor_counts(const glm::dmat3& jacobian, glm::dvec3 force_n) noexcept;

/// The force on the hand that motor counts make: the inverse of motor_counts() but for rounding.
glm::dvec3 force_of(const glm::dmat3& jacobian, const std::array<int16_t, 3>& counts) noexcept;

}  // namespace palpate::devices::falcon
