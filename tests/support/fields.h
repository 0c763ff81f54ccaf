#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "compute/volume/field.h"
#include "tests/support/random.h"
#include "tests/volume/grids.h"

namespace palpate::test {

/// u = offset + slope (x - centre of the grid), LPS mm: trilinear interpolation is exact for it.
inline Field linear_field(const Grid& grid, glm::dvec3 offset_mm, const glm::dmat3& slope) {
  Field field = still_field(grid);
  const glm::dvec3 centre = grid.lps_from_index(0.5 * glm::dvec3(grid.size - 1));
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 x = grid.lps_from_index(glm::dvec3(i, j, k)) - centre;
        field.u_mm[grid.offset(i, j, k)] = glm::vec3(offset_mm + slope * x);
      }
  return field;
}

/// Independent random vectors: the roughest field possible.
inline Field rough_field(const Grid& grid, Random& random, double reach_mm) {
  Field field = still_field(grid);
  for (glm::vec3& u : field.u_mm) u = glm::vec3(random.vector(reach_mm));
  return field;
}

/// A sum of sine waves with wavelengths of `shortest_mm` or more, each with a steepest slope of 1:
/// smooth, as an estimated field is. Scale it to get the contraction that a test needs.
inline Field smooth_field(const Grid& grid, Random& random, double shortest_mm, int waves = 6) {
  struct Wave {
    glm::dvec3 k, amplitude;
    double phase;
  };
  std::vector<Wave> all;
  for (int w = 0; w < waves; ++w) {
    const double k = 2.0 * std::numbers::pi / (shortest_mm * random.draw(1.0, 4.0));
    const glm::dvec3 along = glm::normalize(random.vector(1.0) + glm::dvec3(1e-9));
    const glm::dvec3 towards = glm::normalize(random.vector(1.0) + glm::dvec3(1e-9));
    all.push_back({k * along, towards / k, random.draw(0.0, 2.0 * std::numbers::pi)});
  }
  Field field = still_field(grid);
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 x = grid.lps_from_index(glm::dvec3(i, j, k));
        glm::dvec3 u(0.0);
        for (const Wave& w : all) u += w.amplitude * std::sin(glm::dot(w.k, x) + w.phase);
        field.u_mm[grid.offset(i, j, k)] = glm::vec3(u);
      }
  return field;
}

inline Field scaled(Field field, double factor) {
  for (glm::vec3& u : field.u_mm) u *= float(factor);
  return field;
}

/// n^3 samples of spacing_mm about the LPS origin.
inline Grid cube_grid(int n, double spacing_mm) {
  Grid grid;
  grid.size = glm::ivec3(n);
  grid.spacing_mm = glm::dvec3(spacing_mm);
  grid.origin_mm = glm::dvec3(-0.5 * spacing_mm * (n - 1));
  return grid;
}

/// A continuous index anywhere in the grid, up to `beyond` samples outside it.
inline glm::dvec3 some_index(const Grid& grid, Random& random, double beyond = 0.0) {
  glm::dvec3 index;
  for (int a = 0; a < 3; ++a) index[a] = random.draw(-beyond, grid.size[a] - 1 + beyond);
  return index;
}

}  // namespace palpate::test
