#include <algorithm>
#include <cmath>

#include "shaders/interface/motion.h"
#include "tests/motion/oracle/oracle.h"

namespace palpate::oracle {
namespace {

bool nearly_inside(glm::ivec3 size, glm::dvec3 index) {
  return glm::all(glm::greaterThanEqual(index, glm::dvec3(-0.5))) &&
         glm::all(glm::lessThanEqual(index, glm::dvec3(size) - 0.5));
}

double smooth_step(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// det(I + dv/dx) by differences of neighbours at `step` cells along each axis; zero difference at
/// the border.
double determinant_of(const Vectors& v, glm::ivec3 i, glm::dvec3 cell_mm, int step) {
  glm::dmat3 m(1.0);
  for (int axis = 0; axis < 3; ++axis) {
    glm::ivec3 aside = i;
    aside[axis] = std::clamp(i[axis] + step, 0, v.size[axis] - 1);
    m[axis] += (v.at(aside) - v.at(i)) / (double(step) * cell_mm[axis]);
  }
  return glm::determinant(m);
}

}  // namespace

Samples<NormalEquations> normal_equations(const Texels& fixed, const Texels& moving,
                                          const Vectors& field, glm::ivec3 cell,
                                          glm::dvec3 spacing_mm, int colour) {
  Samples<NormalEquations> result(cells_of(fixed.size, cell));
  const double share = (colour < 0 ? 1.0 : 2.0) / (double(cell.x) * cell.y * cell.z);
  for_each(fixed.size, [&](glm::ivec3 x) {
    if (colour >= 0 && (x.x + x.y + x.z + colour) % 2 != 0) return;
    const glm::dvec3 u_mm = sample(field, cell_index(glm::dvec3(x), cell));
    const glm::dvec3 partner = glm::dvec3(x) + u_mm / spacing_mm;
    const glm::dvec4& f = fixed.at(x);
    if (!inside_mask(f) || !nearly_inside(moving.size, partner)) return;
    // One sample outside the mask makes the gradient of all places next to it infinite.
    const glm::dvec4 m = sample(moving, partner);
    const double r = f.w - m.w;
    const glm::dvec3 g = inside_mask(m) ? 0.5 * (glm::dvec3(f) + glm::dvec3(m)) : glm::dvec3(f);
    NormalEquations& sums = result.at(x / cell);
    sums.b += share * r * g;
    sums.a += share * glm::outerProduct(g, g);
    sums.residual += share * r * r;
    sums.counted += share;
    sums.structure += share * 0.5 * (f.w * f.w + m.w * m.w);
  });
  return result;
}

Vectors update(const Samples<NormalEquations>& equations, const Vectors& v, glm::dvec3 cell_mm,
               double damping_per_mm2, double largest_mm) {
  Vectors w(v.size);
  for_each(v.size, [&](glm::ivec3 i) {
    const NormalEquations& e = equations.at(i);
    glm::dvec3 d = glm::inverse(e.a + damping_per_mm2 * glm::dmat3(1.0)) * e.b;
    if (glm::length(d) > largest_mm) d *= largest_mm / glm::length(d);
    w.at(i) = sample(v, glm::dvec3(i) + d / cell_mm) + d;
  });
  return w;
}

TwoWindowsStep update_two(const Samples<NormalEquations>& wide,
                          const Samples<NormalEquations>& narrow,
                          const Samples<NormalEquations>& coarser, const Vectors& v,
                          glm::dvec3 cell_mm, const TwoWindows& with, const Scalars* chosen) {
  TwoWindowsStep result{Vectors(v.size), Scalars(v.size)};
  const auto shortened = [&](glm::dvec3 d) {
    const double length = glm::length(d);
    return length > with.largest_mm ? d * (with.largest_mm / length) : d;
  };
  for_each(v.size, [&](glm::ivec3 i) {
    const double rho = left_over(coarser.at(i), with.noise, with.flat);
    const double det =
        std::min(determinant_of(v, i, cell_mm, 1), determinant_of(v, i, cell_mm, -1));
    const double unfolded = smooth_step(shaders::kSteepest, shaders::kGentle, det);
    const double s = smooth_step(with.low, with.high, rho) * unfolded;
    const double seen = smooth_step(shaders::kFew, shaders::kMost, narrow.at(i).counted);
    const double added = chosen ? std::max(s, chosen->at(i) * unfolded * seen) : s;
    const glm::dmat3 damping(glm::mix(with.damping_per_mm2[0], with.damping_per_mm2[1], s));

    glm::dvec3 d = shortened(glm::inverse(wide.at(i).a + damping) * wide.at(i).b);
    const NormalEquations& n = narrow.at(i);
    const glm::dmat3 inverse = glm::inverse(n.a + damping);
    d = shortened(d + added * (inverse * (n.b - n.a * d)));
    result.w.at(i) = sample(v, glm::dvec3(i) + d / cell_mm) + d;

    const double gain = glm::dot(n.b, inverse * n.b);
    const double noise = std::max(n.residual - gain, 1e-3 * n.residual + 1e-8);
    const double evidence = with.voxels * n.counted * gain / noise;
    result.more.at(i) = s * (with.weight / (1.0 + evidence / with.evidence) - 1.0);
  });
  return result;
}

bool is_left_out(glm::ivec3 cell, int part) {
  return (cell.x / 2 + cell.y / 2 + cell.z / 2) % 2 == part;
}

Samples<NormalEquations> leave_out(const Samples<NormalEquations>& equations, int part) {
  Samples<NormalEquations> left = equations;
  for_each(equations.size, [&](glm::ivec3 i) {
    if (is_left_out(i, part)) left.at(i) = NormalEquations();
  });
  return left;
}

glm::dvec4 shared_noise(const NormalEquations& e, double voxels) {
  const double trace = e.a[0][0] + e.a[1][1] + e.a[2][2];
  return {voxels * e.counted * glm::dot(e.b, e.b) / (e.residual * trace), e.structure / e.counted,
          e.residual / (2.0 * e.structure), e.counted};
}

Vectors refit(const Samples<NormalEquations>& equations, const Vectors& v, const Vectors& u0,
              double damping_per_mm2, double largest_mm) {
  Vectors w(v.size);
  for_each(v.size, [&](glm::ivec3 i) {
    const NormalEquations& e = equations.at(i);
    glm::dvec3 d =
        glm::inverse(e.a + damping_per_mm2 * glm::dmat3(1.0)) * (e.b - e.a * (v.at(i) - u0.at(i)));
    if (glm::length(d) > largest_mm) d *= largest_mm / glm::length(d);
    w.at(i) = v.at(i) + d;
  });
  return w;
}

Scalars left_out_error(const Samples<NormalEquations>& equations, const Vectors& u,
                       const Vectors& u0, int part) {
  Scalars error(u.size);
  for_each(u.size, [&](glm::ivec3 i) {
    const NormalEquations& e = equations.at(i);
    const glm::dvec3 d = u.at(i) - u0.at(i);
    if (is_left_out(i, part)) error.at(i) = glm::dot(d, e.a * d) - 2.0 * glm::dot(e.b, d);
  });
  return error;
}

double window_share(double gain, double structure, double low, double high) {
  return smooth_step(low, high, -gain / structure);
}

Vectors tv_primal(const Vectors& w, const Dual& p, glm::dvec3 slope) {
  Vectors u = w;
  for_each(w.size, [&](glm::ivec3 i) {
    for (int axis = 0; axis < 3; ++axis) {
      glm::ivec3 step(0);
      step[axis] = 1;
      const Vectors& along = p[size_t(axis)];
      if (i[axis] + 1 < w.size[axis]) u.at(i) += slope[axis] * along.at(i);
      if (i[axis] > 0) u.at(i) -= slope[axis] * along.at(i - step);
    }
  });
  return u;
}

Vectors ahead(const Vectors& u, const Vectors& before, double momentum) {
  Vectors v = u;
  for (size_t i = 0; i < u.values.size(); ++i)
    v.values[i] += momentum * (u.values[i] - before.values[i]);
  return v;
}

namespace {

/// 1 plus the mean addition to the weight of a cell and the next one along each axis.
double weight_at(glm::ivec3 i, const Scalars* more) {
  if (!more) return 1.0;
  double sum = more->at(i);
  for (int axis = 0; axis < 3; ++axis) {
    glm::ivec3 next(0);
    next[axis] = 1;
    sum += more->held(i + next);
  }
  return std::max(1e-3, 1.0 + 0.25 * sum);
}

/// One second difference: factor * sum_k weight_k u(i + offset_k), where all of these cells exist.
struct SecondDifference {
  double factor = 0.0;
  std::vector<std::pair<glm::ivec3, double>> terms;

  bool exists(glm::ivec3 i, glm::ivec3 size) const {
    return std::all_of(terms.begin(), terms.end(), [&](const auto& term) {
      const glm::ivec3 at = i + term.first;
      return glm::all(glm::greaterThanEqual(at, glm::ivec3(0))) &&
             glm::all(glm::lessThan(at, size));
    });
  }
};

std::array<SecondDifference, 6> second_differences(glm::dvec3 slope) {
  std::array<SecondDifference, 6> all;
  size_t mixed = 3;
  for (int a = 0; a < 3; ++a) {
    glm::ivec3 along(0);
    along[a] = 1;
    all[size_t(a)] = {slope[a] * slope[a], {{-along, 1.0}, {glm::ivec3(0), -2.0}, {along, 1.0}}};
    for (int b = a + 1; b < 3; ++b) {
      glm::ivec3 across(0);
      across[b] = 1;
      all[mixed++] = {std::sqrt(2.0) * slope[a] * slope[b],
                      {{glm::ivec3(0), 1.0}, {along, -1.0}, {across, -1.0}, {along + across, 1.0}}};
    }
  }
  return all;
}

}  // namespace

Vectors tv_second_primal(const Vectors& w, const SecondDual& q, glm::dvec3 slope) {
  Vectors u = w;
  const auto differences = second_differences(slope);
  for (size_t d = 0; d < q.size(); ++d) {
    for_each(w.size, [&](glm::ivec3 i) {
      if (!differences[d].exists(i, w.size)) return;
      for (const auto& [offset, weight] : differences[d].terms)
        u.at(i + offset) -= differences[d].factor * weight * q[d].at(i);
    });
  }
  return u;
}

SecondDual tv_second_dual(const Vectors& u, const SecondDual& q, glm::dvec3 slope, double c_mm,
                          double step, double huber_mm, const Scalars* more) {
  SecondDual result = q;
  const auto differences = second_differences(slope);
  for_each(u.size, [&](glm::ivec3 i) {
    const double radius = c_mm * std::min(1.0, weight_at(i, more));
    double squares = 0.0;
    for (size_t d = 0; d < q.size(); ++d) {
      glm::dvec3& at = result[d].at(i);
      if (differences[d].exists(i, u.size))
        for (const auto& [offset, weight] : differences[d].terms)
          at += step * differences[d].factor * weight * u.at(i + offset);
      at /= 1.0 + step * huber_mm / radius;
      squares += glm::dot(at, at);
    }
    const double over = std::sqrt(squares) / radius;
    if (over > 1.0)
      for (Vectors& one : result) one.at(i) /= over;
  });
  return result;
}

Dual tv_dual(const Vectors& u, const Dual& p, glm::dvec3 slope, double c_mm, double step,
             double huber_mm, const Scalars* more) {
  Dual result = p;
  for_each(u.size, [&](glm::ivec3 i) {
    const double radius = c_mm * weight_at(i, more);
    double squares = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      glm::ivec3 next(0);
      next[axis] = 1;
      glm::dvec3& q = result[size_t(axis)].at(i);
      q += step * slope[axis] * (u.held(i + next) - u.at(i));
      q /= 1.0 + step * huber_mm / radius;
      squares += glm::dot(q, q);
    }
    const double over = std::sqrt(squares) / radius;
    if (over > 1.0) {
      for (Vectors& along : result) along.at(i) /= over;
    }
  });
  return result;
}

Vectors classic_force(const Texels& fixed, const Texels& moving, const Vectors& field,
                      glm::dvec3 spacing_mm) {
  Vectors updated = field;
  for_each(field.size, [&](glm::ivec3 i) {
    const glm::dvec3 at = glm::dvec3(i) + field.at(i) / spacing_mm;
    if (!inside_mask(fixed.at(i))) return;
    const double d = sample(moving, at).w - fixed.at(i).w;
    const glm::dvec3 g = glm::dvec3(fixed.at(i)) * spacing_mm;
    const double below = glm::dot(g, g) + d * d;
    if (below > 0.0) updated.at(i) -= spacing_mm * (d / below * g);
  });
  return updated;
}

}  // namespace palpate::oracle
