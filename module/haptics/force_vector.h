#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

namespace palpate {

/// True if no component is NaN or infinite.
inline bool is_finite(glm::dvec3 v) noexcept {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// |v|, right for finite components of any size (their squares may overflow).
inline double length_of(glm::dvec3 v) noexcept {
  const double most = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  return most > 0.0 && std::isfinite(most) ? most * glm::length(v / most) : most;
}

/// v with its length cut to `most`, its direction kept. v finite, most >= 0.
inline glm::dvec3 shortened(glm::dvec3 v, double most) noexcept {
  const double length = length_of(v);
  // v / length first: `most / length` may underflow.
  return length > most ? most * (v / length) : v;
}

}  // namespace palpate
