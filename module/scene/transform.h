#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "compute/volume/result.h"

namespace palpate {

/// Where a volume is: x_world = translation_m + rotation * (scale * x_volume), the split of the
/// paper's equations (17) to (20). World: metres, right-handed, y up. Volume space: metres,
/// right-handed, y up, the patient's axes turned (see volume_from_lps); scale acts along its axes.
struct Transform {
  glm::dvec3 translation_m{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};  ///< unit length; w first, as GLM has it
  glm::dvec3 scale{1.0};                    ///< per axis of volume space; > 0

  glm::dmat3 linear() const {
    glm::dmat3 m = glm::mat3_cast(rotation);
    for (int a = 0; a < 3; ++a) m[a] *= scale[a];
    return m;
  }
  glm::dvec3 world_from_volume(glm::dvec3 x) const {
    return translation_m + rotation * (scale * x);
  }
  glm::dvec3 volume_from_world(glm::dvec3 x) const {
    return (glm::conjugate(rotation) * (x - translation_m)) / scale;
  }
  bool operator==(const Transform&) const = default;
};

/// The rotation that is a `share` of the shorter way from one rotation to another (slerp). Both
/// have unit length, and so has the result. Real-time safe.
glm::dquat between(const glm::dquat& from, glm::dquat to, double share) noexcept;

/// Splits a 4 x 4 matrix (column vectors, as OpenXR and GLM have it). kBadInput, in one sentence,
/// for what a hand can not be given: not affine, not finite, a mirror (determinant <= 0), shear
/// (columns more than 1e-6 off a right angle), a scale outside 1e-4 to 1e4. Any thread; does not
/// allocate when it succeeds.
Result<Transform> split(const glm::dmat4& world_from_volume);

/// kBadInput, in one sentence, for a transform that can not be felt: as split(), and a rotation
/// that is none (length more than 1e-6 off 1).
Status check(const Transform& transform);

/// The matrix again.
glm::dmat4 matrix(const Transform& transform);

/// Volume space (m, y up) from the patient's (LPS mm) and back: x = L, y = S, z = -P, times 0.001.
/// Determinant +: a mirror image would be a clinical error.
inline glm::dvec3 volume_from_lps(glm::dvec3 mm) {
  return 1e-3 * glm::dvec3(mm.x, mm.z, -mm.y);
}
inline glm::dvec3 lps_from_volume(glm::dvec3 m) {
  return 1e3 * glm::dvec3(m.x, -m.z, m.y);
}

}  // namespace palpate
