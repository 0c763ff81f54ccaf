#pragma once

#include <array>

#include "tests/motion/oracle/oracle.h"
#include "tests/support/random.h"

namespace palpate::test {

/// Normal equations as the kernels store them: three images (b Axx)(Axy Axz Ayy Ayz)(Azz r^2 w q).
using EquationImages = std::array<oracle::Texels, 3>;

inline EquationImages images_of(const oracle::Samples<oracle::NormalEquations>& equations) {
  const oracle::Texels empty(equations.size);
  EquationImages images = {empty, empty, empty};
  for (size_t i = 0; i < equations.values.size(); ++i) {
    const oracle::NormalEquations& e = equations.values[i];
    images[0].values[i] = glm::dvec4(e.b, e.a[0][0]);
    images[1].values[i] = {e.a[0][1], e.a[0][2], e.a[1][1], e.a[1][2]};
    images[2].values[i] = {e.a[2][2], e.residual, e.counted, e.structure};
  }
  return images;
}

inline oracle::Samples<oracle::NormalEquations> equations_of(const EquationImages& images) {
  oracle::Samples<oracle::NormalEquations> equations(images[0].size);
  for (size_t i = 0; i < equations.values.size(); ++i) {
    const glm::dvec4 e0 = images[0].values[i], e1 = images[1].values[i], e2 = images[2].values[i];
    oracle::NormalEquations& e = equations.values[i];
    e.b = glm::dvec3(e0);
    e.a = glm::dmat3(e0.w, e1.x, e1.y, e1.x, e1.z, e1.w, e1.y, e1.w, e2.x);
    e.residual = e2.y;
    e.counted = e2.z;
    e.structure = e2.w;
  }
  return equations;
}

/// Equations as after smoothing: means of several g g^T with a matching b, so that A is positive
/// definite in most cells. In every fifth cell A has rank one, as at an edge; in every seventh
/// hardly any voxel counts.
inline oracle::Samples<oracle::NormalEquations> random_equations(glm::ivec3 cells, uint32_t seed) {
  Random random(seed);
  oracle::Samples<oracle::NormalEquations> equations(cells);
  for (size_t i = 0; i < equations.values.size(); ++i) {
    oracle::NormalEquations& e = equations.values[i];
    const int gradients = i % 5 == 0 ? 1 : 6;
    for (int k = 0; k < gradients; ++k) {
      const glm::dvec3 g = random.vector(1.0);
      e.b += random.draw(-1.0, 1.0) * g / double(gradients);
      e.a += glm::outerProduct(g, g) / double(gradients);
    }
    e.counted = i % 7 == 0 ? 0.005 : random.draw(0.02, 1.0);
    e.residual = random.draw(0.0, 1.0) * e.counted;
    e.structure = random.draw(0.2, 1.0) * e.counted;
  }
  return equations;
}

}  // namespace palpate::test
