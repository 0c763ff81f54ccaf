#include "module/scene/transform.h"

#include <cmath>

#include "compute/volume/portable.h"

namespace palpate {
namespace {

constexpr double kRightAngle = 1e-6;  // rounding of a float matrix that went through a few products
constexpr double kSmallest = 1e-4, kLargest = 1e4;

Error refused(const char* what) {
  return {ErrorKind::kBadInput, std::string("This transform can not be felt: ") + what +
                                    "; give a matrix of translation, rotation and scale only."};
}

}  // namespace

Result<Transform> split(const glm::dmat4& m) {
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 4; ++r)
      if (!std::isfinite(m[c][r])) return refused("it holds a value that is not finite");
  if (std::abs(m[0][3]) + std::abs(m[1][3]) + std::abs(m[2][3]) + std::abs(m[3][3] - 1.0) > 1e-9)
    return refused("its last row is not 0 0 0 1, so it is a projection");
  glm::dmat3 a(m);
  Transform t;
  t.translation_m = glm::dvec3(m[3]);
  for (int c = 0; c < 3; ++c) {
    t.scale[c] = glm::length(a[c]);
    if (!(t.scale[c] >= kSmallest && t.scale[c] <= kLargest))
      return refused("an axis is scaled by less than 1e-4 or more than 1e4");
    a[c] /= t.scale[c];
  }
  if (glm::determinant(a) <= 0.0) return refused("it is a mirror image (negative determinant)");
  if (std::abs(glm::dot(a[0], a[1])) > kRightAngle ||
      std::abs(glm::dot(a[1], a[2])) > kRightAngle || std::abs(glm::dot(a[2], a[0])) > kRightAngle)
    return refused("it is sheared (its axes are not at right angles)");
  t.rotation = glm::normalize(glm::quat_cast(a));
  return t;
}

glm::dquat between(const glm::dquat& from, glm::dquat to, double share) noexcept {
  if (glm::dot(from, to) < 0.0) to = -to;
  const glm::dquat way = glm::conjugate(from) * to;
  const glm::dvec3 axis(way.x, way.y, way.z);
  const double sine = glm::length(axis);
  // Nearly equal: linear interpolation has the same bits, and there is no axis to divide by.
  if (sine < 1e-9) return glm::normalize(from * (1.0 - share) + to * share);
  const auto [s, c] = portable::sin_cos(share * portable::atan2(sine, way.w));
  return glm::normalize(from * glm::dquat(c, s / sine * axis));
}

Status check(const Transform& t) {
  const double length = glm::length(t.rotation);
  if (!std::isfinite(glm::dot(t.translation_m, t.scale)) || !std::isfinite(length))
    return refused("it holds a value that is not finite");
  if (std::abs(length - 1.0) > kRightAngle) return refused("its rotation is not of unit length");
  if (t.scale.x * t.scale.y * t.scale.z < 0.0)
    return refused("it is a mirror image (negative determinant)");
  for (int a = 0; a < 3; ++a)
    if (!(t.scale[a] >= kSmallest && t.scale[a] <= kLargest))
      return refused("an axis is scaled by less than 1e-4 or more than 1e4");
  return Nothing{};
}

glm::dmat4 matrix(const Transform& transform) {
  glm::dmat4 m(transform.linear());
  m[3] = glm::dvec4(transform.translation_m, 1.0);
  return m;
}

}  // namespace palpate
