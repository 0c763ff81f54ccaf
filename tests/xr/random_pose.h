#pragma once

#include "module/scene/pose.h"
#include "tests/support/random.h"

namespace palpate::test {

/// Any rotation; each component of the position in [-reach, reach).
inline Pose random_pose(Random& random, double reach) {
  const glm::dvec3 at = random.vector(reach);
  return {at, random.turn()};
}

}  // namespace palpate::test
