#pragma once

#include <array>

#include "module/haptics/primitive.h"

namespace palpate {

/// What a plane knows of the data it stands in, if it is a surface of equal value.
struct SurfaceValue {
  double value = 0.0;  ///< of the data where it stands
  /// of that value along the plane's direction, world; 0: no such surface
  double slope_per_m = 0.0;
};

/// The primitives of all modes at one place of the proxy.
struct Placed {
  PrimitiveSet set;
  std::array<SurfaceValue, PrimitiveSet::kCapacity> surface_value;
  std::array<uint8_t, PrimitiveSet::kCapacity> owner;  ///< of each, the index of its mode
  glm::dvec3 pull{0.0};         ///< where the probe acts: shifted by the directed forces
  double drag_n_s_per_m = 0.0;  ///< of all modes
  glm::dvec3 drag_at_n_s{0.0};  ///< sum of each mode's drag times where its material is, world
};

}  // namespace palpate
