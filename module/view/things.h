#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

namespace palpate {

/// An opaque thing: all spheres between two, their centres and radii blended. A sphere, a rod with
/// round ends, an arrow's head: everything that is drawn beside volumes is made of these. World, m.
struct RoundCone {
  glm::dvec3 from{0.0}, to{0.0};
  double from_radius_m = 1e-3, to_radius_m = 1e-3;
  glm::dvec3 colour{0.9};  ///< sRGB
};

}  // namespace palpate
