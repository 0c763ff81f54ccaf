#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "shaders/interface/motion.h"
#include "tests/motion/oracle/oracle.h"

namespace palpate::oracle {
namespace {

constexpr double kCountsAtAll = 0.01;

/// Smallest and largest, by Jacobi rotations: each makes one pair of off-diagonal elements zero.
glm::dvec2 extreme_eigenvalues(glm::dmat3 a) {
  for (int round = 0; round < 30; ++round) {
    const int p = round % 3 == 2 ? 1 : 0;
    const int q = round % 3 == 0 ? 1 : 2;
    const double angle = 0.5 * std::atan2(2.0 * a[p][q], a[q][q] - a[p][p]);
    glm::dmat3 turn(1.0);
    turn[p][p] = turn[q][q] = std::cos(angle);
    turn[q][p] = std::sin(angle);
    turn[p][q] = -std::sin(angle);
    a = glm::transpose(turn) * a * turn;
  }
  return {std::min({a[0][0], a[1][1], a[2][2]}), std::max({a[0][0], a[1][1], a[2][2]})};
}

/// det(I + grad u) at corner `side` (0 or 1 per axis) of the unit cube that begins at voxel x.
double corner_determinant(const Vectors& u_at_voxels, glm::ivec3 x, glm::ivec3 side,
                          glm::dvec3 spacing_mm) {
  glm::dmat3 jacobian(1.0);
  for (int axis = 0; axis < 3; ++axis) {
    glm::ivec3 low = x + side;
    glm::ivec3 high = low;
    low[axis] = x[axis];
    high[axis] = x[axis] + 1;
    // Clamped: along an axis of one voxel the difference is zero.
    jacobian[axis] += (u_at_voxels.held(high) - u_at_voxels.held(low)) / spacing_mm[axis];
  }
  return glm::determinant(jacobian);
}

}  // namespace

Vectors upsample(const Vectors& from, glm::ivec3 to_cells, glm::dvec3 scale, glm::dvec3 offset) {
  Vectors to(to_cells);
  for_each(to_cells,
           [&](glm::ivec3 i) { to.at(i) = sample(from, scale * glm::dvec3(i) + offset); });
  return to;
}

Vectors measure(const Vectors& field, const Vectors& seen,
                const Samples<NormalEquations>& equations, double unit_mm) {
  Vectors looks(cells_of(field.size, glm::ivec3(shaders::kBrick)));
  for_each(field.size, [&](glm::ivec3 i) {
    glm::dvec3& look = looks.at(i / shaders::kBrick);
    look.x = std::max(look.x, glm::length(field.at(i) - seen.at(i)) / unit_mm);
    look.z = std::max(look.z, glm::length(field.at(i)) / unit_mm);
    const NormalEquations& e = equations.at(i);
    if (e.counted > kCountsAtAll) look.y = std::max(look.y, e.structure / e.counted);
  });
  return looks;
}

double left_over(const NormalEquations& left, double noise, double flat) {
  const double beyond_noise =
      std::max(0.0, left.residual - noise * std::max(0.0, left.counted - left.structure));
  return beyond_noise / (2.0 * left.structure + flat * left.counted + 1e-4);
}

Vectors deviation(const Samples<NormalEquations>& equations, const Vectors& field,
                  const Judging& with) {
  Vectors result(equations.size);
  for_each(equations.size, [&](glm::ivec3 i) {
    const NormalEquations& e = equations.at(i);
    const bool counted = e.counted > shaders::kCounts;
    glm::dmat3 a = e.a;
    double others = 0.0, steep = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double edge_mm = with.spacing_mm[axis];
      a[axis][axis] -= shaders::kNoiseOfGradient * e.residual / (edge_mm * edge_mm);
      others += std::max(0.0, a[axis][axis]);
      for (const int side : {-1, 1}) {
        glm::ivec3 next = i;
        next[axis] += side;
        steep = std::max(steep, glm::length(field.held(next) - field.at(i)) / with.cell_mm[axis]);
      }
    }
    for (int axis = 0; axis < 3; ++axis)
      if (equations.size[axis] == 1) a[axis][axis] = others;
    // Both are means over all voxels, so the share of counted voxels cancels.
    const glm::dvec2 l = extreme_eigenvalues(a);
    const auto variance = [&](double eigenvalue) {
      const double bound = (e.residual + shaders::kLeastResidual * e.counted) /
                           (with.voxels * with.h_mm * with.h_mm * std::max(eigenvalue, 1e-12));
      return counted ? std::min(bound, double(shaders::kUnknown)) : double(shaders::kUnknown);
    };
    const double damping = std::pow(shaders::kRestDamping / with.h_mm, 2);
    const double step = glm::length(glm::inverse(e.a + glm::dmat3(damping)) * e.b) / with.h_mm;
    const double rest = counted && step < 1.0 ? step : 1.0;
    const double base = with.h_mm * std::pow(rest + shaders::kRest, 0.4) *
                        std::pow(steep + shaders::kSteep, 0.8) /
                        std::clamp(e.counted, double(shaders::kLeastShare), 1.0);
    const double guess =
        shaders::kGuess * with.h_mm * std::sqrt(variance(l[1]) / shaders::kUnknown);
    const auto sd = [&](double factor, double eigenvalue) {
      return std::max(guess,
                      factor * base * std::pow(variance(eigenvalue) + shaders::kCertain, 0.25));
    };
    const double along = sd(shaders::kAlong, l[1]), across = sd(shaders::kAcross, l[0]);
    const double radius = shaders::kErrorRadius * std::sqrt(along * along + 2.0 * across * across);
    const double likely =
        1.0 / (1.0 + std::pow(2.0 * radius / with.h_mm, shaders::kErrorTail) / 19.0);
    result.at(i) = {along, across, counted ? likely : 0.0};
  });
  return result;
}

Scalars folds(const Vectors& field, glm::ivec3 cell, glm::ivec3 image_size, glm::dvec3 spacing_mm,
              bool between) {
  Vectors u(image_size);
  for_each(image_size,
           [&](glm::ivec3 x) { u.at(x) = sample(field, cell_index(glm::dvec3(x), cell)); });
  Scalars smallest(field.size, 1.0);
  // A cube begins at every voxel but the last one of an axis; also at the only voxel of an axis.
  for_each(between ? glm::max(image_size - 1, glm::ivec3(1)) : glm::ivec3(0), [&](glm::ivec3 x) {
    double& least = smallest.at(x / cell);
    for_each(glm::ivec3(2), [&](glm::ivec3 side) {
      least = std::min(least, corner_determinant(u, x, side, spacing_mm));
    });
  });
  // The cubes of cells, evaluated at the middles of cells.
  for_each(glm::max(field.size - 1, glm::ivec3(1)), [&](glm::ivec3 x) {
    for_each(glm::min(field.size, glm::ivec3(2)), [&](glm::ivec3 side) {
      double& least = smallest.at(x + side);
      least = std::min(least, corner_determinant(field, x, side, spacing_mm * glm::dvec3(cell)));
    });
  });
  return smallest;
}

Vectors blend(const Scalars& flags, const Vectors& field) {
  Vectors result = field;
  for_each(field.size, [&](glm::ivec3 i) {
    bool touched = false;
    glm::dvec3 smooth(0.0);
    for_each(glm::ivec3(3), [&](glm::ivec3 tap) {
      const glm::ivec3 k = tap - 1;
      touched = touched || flags.held(i + k) > 0.0;
      const double weight = (2 - std::abs(k.x)) * (2 - std::abs(k.y)) * (2 - std::abs(k.z)) / 64.0;
      smooth += weight * field.held(i + k);
    });
    if (touched) result.at(i) = smooth;
  });
  return result;
}

}  // namespace palpate::oracle
