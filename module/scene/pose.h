#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

namespace palpate {

/// A rigid placement, named target_from_source: x_target = position_m + rotation * x_source.
/// Metres, right-handed, y up; rotation of unit length.
struct Pose {
  glm::dvec3 position_m{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};  ///< w first, as GLM has it

  glm::dvec3 operator()(glm::dvec3 x) const { return position_m + rotation * x; }
};

/// a_from_c of a_from_b and b_from_c. Normalises, so that a long chain stays rigid.
inline Pose operator*(const Pose& a, const Pose& b) {
  return {a(b.position_m), glm::normalize(a.rotation * b.rotation)};
}

inline Pose inverse(const Pose& pose) {
  const glm::dquat back = glm::conjugate(pose.rotation);
  return {back * -pose.position_m, back};
}

}  // namespace palpate
