#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include "compute/volume/grid.h"

namespace palpate::test {

/// A rotation about a seeded axis.
inline glm::dmat3 some_rotation(uint32_t seed) {
  std::mt19937 engine(seed);
  const auto draw = [&] { return double(engine()) / 4294967295.0 - 0.5; };
  const glm::dvec3 a = glm::normalize(glm::dvec3(draw(), draw(), draw() + 1.0));
  const glm::dvec3 b = glm::normalize(glm::cross(a, glm::dvec3(0.3, 1.0, draw())));
  return glm::dmat3(a, b, glm::cross(a, b));
}

/// Odd sizes, three different spacings, an oblique direction, as from real scanners.
inline Grid oblique_grid() {
  Grid grid;
  grid.size = {13, 11, 7};
  grid.spacing_mm = {0.7, 1.1, 2.5};
  grid.origin_mm = {-31.0, 12.0, 5.0};
  grid.direction = some_rotation(3);
  return grid;
}

}  // namespace palpate::test
