#include "module/scene/property.h"

namespace palpate {
namespace {

/// J[j][i] is d v_i / d x_j.
glm::dvec3 curl(const glm::dmat3& j) {
  return {j[1][2] - j[2][1], j[2][0] - j[0][2], j[0][1] - j[1][0]};
}

/// d |v| / dx.
glm::dvec3 length_gradient(glm::dvec3 v, const glm::dmat3& jacobian) {
  const double length = glm::length(v);
  return length > 0.0 ? (v / length) * jacobian : glm::dvec3(0.0);
}

glm::dvec3 differences(const FrameData& data, ScalarProperty property, glm::dvec3 x) {
  const double step = 0.5 * data.detail_m();
  glm::dvec3 gradient;
  for (int a = 0; a < 3; ++a) {
    glm::dvec3 aside(0.0);
    aside[a] = step;
    gradient[a] = (scalar_of(data, property, x + aside) - scalar_of(data, property, x - aside)) /
                  (2.0 * step);
  }
  return gradient;
}

}  // namespace

double scalar_of(const FrameData& data, ScalarProperty property, glm::dvec3 x_m) noexcept {
  switch (property) {
    case ScalarProperty::kValue:
      return data.scalar(x_m);
    case ScalarProperty::kGradientMagnitude:
      return glm::length(data.scalar_gradient(x_m));
    case ScalarProperty::kMagnitude:
      return glm::length(data.vector(x_m));
    case ScalarProperty::kDivergence: {
      const glm::dmat3 j = data.vector_jacobian(x_m);
      return j[0][0] + j[1][1] + j[2][2];
    }
    case ScalarProperty::kCurlMagnitude:
      return glm::length(curl(data.vector_jacobian(x_m)));
  }
  return 0.0;
}

glm::dvec3 gradient_of(const FrameData& data, ScalarProperty property, glm::dvec3 x_m) noexcept {
  switch (property) {
    case ScalarProperty::kValue:
      return data.scalar_gradient(x_m);
    case ScalarProperty::kGradientMagnitude:
      // The vector of scalar data is its gradient, so the vector's Jacobian is the Hessian.
      if (data.is_vector()) return differences(data, property, x_m);
      [[fallthrough]];
    case ScalarProperty::kMagnitude:
      return length_gradient(data.vector(x_m), data.vector_jacobian(x_m));
    case ScalarProperty::kDivergence:
    case ScalarProperty::kCurlMagnitude:
      return differences(data, property, x_m);
  }
  return glm::dvec3(0.0);
}

glm::dvec3 vector_of(const FrameData& data, VectorProperty property, glm::dvec3 x_m) noexcept {
  switch (property) {
    case VectorProperty::kVector:
      return data.vector(x_m);
    case VectorProperty::kGradient:
      return data.scalar_gradient(x_m);
    case VectorProperty::kCurl:
      return curl(data.vector_jacobian(x_m));
  }
  return glm::dvec3(0.0);
}

}  // namespace palpate
