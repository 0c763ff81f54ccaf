#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "module/scene/transform.h"

namespace palpate {

/// How a pose changes per second: translation in m, rotation as an angular velocity in the body's
/// own axes, scale as its natural logarithm, so that it can not pass zero.
struct PoseRate {
  glm::dvec3 translation{0.0}, rotation{0.0}, log_scale{0.0};
};
PoseRate operator+(const PoseRate& a, const PoseRate& b);
PoseRate operator*(double factor, const PoseRate& a);

/// The constant rate that leads from one pose to another within a second, the shorter way round.
PoseRate difference(const Transform& from, const Transform& to);

/// A rotation vector as a unit quaternion, and back (of length 0 to pi: the nearer hemisphere).
glm::dquat quaternion_of(glm::dvec3 rotation);
glm::dvec3 rotation_of(glm::dquat q);

/// A piece of a C1 path of poses: cubic Hermite in translation and log scale. Rotation is
/// start * exp(theta(u)) with a cubic theta in rotation vectors whose end derivative is turned back
/// through the derivative of exp, so that the angular velocity is right at both ends. A rotation
/// about one axis at constant speed is followed exactly. A value; real-time safe.
class PoseCurve {
 public:
  PoseCurve() = default;
  /// From one pose with its rate to another with its own, in `duration_s` > 0.
  PoseCurve(const Transform& from, const PoseRate& from_rate, const Transform& to,
            const PoseRate& to_rate, double duration_s);

  /// The share of the curve that is over `passed_s` after its start: 0 at the start, 1 at the end.
  double share(double passed_s) const { return passed_s * per_s_; }
  Transform pose(double share) const;
  PoseRate rate(double share) const;
  bool is_still() const { return still_; }

 private:
  Transform from_, to_;
  double per_s_ = 0.0;
  glm::dvec3 translation_[3], rotation_[3], log_scale_[3];  ///< factors of u, u^2, u^3
  bool still_ = true, rotates_ = false, scales_ = false;
};

}  // namespace palpate
