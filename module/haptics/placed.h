#pragma once

#include <array>

#include "module/haptics/primitive.h"

namespace palpate {

/// The primitives of all modes at one place of the proxy.
struct Placed {
  PrimitiveSet set;
  std::array<uint8_t, PrimitiveSet::kCapacity> owner;  ///< of each, the index of its mode
  glm::dvec3 pull{0.0};  ///< where the probe acts: shifted by the directed forces
};

}  // namespace palpate
