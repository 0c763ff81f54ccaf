#include <algorithm>
#include <cmath>

#include "shaders/interface/motion.h"
#include "tests/motion/oracle/oracle.h"

namespace palpate::oracle {
namespace {

bool inside(glm::dvec3 index, glm::ivec3 size) {
  return glm::all(glm::greaterThanEqual(index, glm::dvec3(-0.5))) &&
         glm::all(glm::lessThanEqual(index, glm::dvec3(size) - 0.5));
}

/// Catmull and Rom's weight of the sample at this distance.
double cubic_weight(double distance) {
  const double d = std::abs(distance);
  if (d < 1.0) return 1.0 - 2.5 * d * d + 1.5 * d * d * d;
  if (d < 2.0) return 2.0 - 4.0 * d + 2.5 * d * d - 0.5 * d * d * d;
  return 0.0;
}

}  // namespace

bool touches(const Scalars& flags, glm::ivec3 i) {
  bool touched = false;
  for_each(glm::ivec3(3),
           [&](glm::ivec3 tap) { touched = touched || flags.held(i + tap - 1) > 0.0; });
  return touched;
}

std::array<double, 7> distances_around(const Vectors& field, glm::ivec3 i) {
  const std::array<glm::ivec3, 7> steps = {glm::ivec3(0), {1, 0, 0},  {0, 1, 0}, {0, 0, 1},
                                           {-1, 0, 0},    {0, -1, 0}, {0, 0, -1}};
  std::array<double, 7> sums{};
  for (size_t m = 0; m < steps.size(); ++m)
    for (const glm::ivec3 n : steps)
      sums[m] += glm::distance(field.held(i + steps[m]), field.held(i + n));
  return sums;
}

Vectors blend_along(const Scalars& flags, const Vectors& field, glm::dvec3 cell_mm, int length) {
  Vectors result = field;
  for_each(field.size, [&](glm::ivec3 i) {
    if (!touches(flags, i)) return;
    glm::dvec3 jump(0.0);
    for (int axis = 0; axis < 3; ++axis) {
      for (const int side : {-1, 1}) {
        glm::ivec3 next = i;
        next[axis] += side;
        const glm::dvec3 difference = field.held(next) - field.at(i);
        if (glm::length(difference) > glm::length(jump)) jump = difference;
      }
    }
    glm::dvec3 d = jump / cell_mm;
    const double longest = std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)});
    if (longest > 0.0) d *= length / longest;
    result.at(i) = 0.5 * field.at(i) +
                   0.25 * (sample(field, glm::dvec3(i) - d) + sample(field, glm::dvec3(i) + d));
  });
  return result;
}

Vectors upsample_cubic(const Vectors& from, glm::ivec3 to_cells, glm::dvec3 scale,
                       glm::dvec3 offset, double cubic) {
  Vectors to(to_cells);
  for_each(to_cells, [&](glm::ivec3 i) {
    const glm::dvec3 at = scale * glm::dvec3(i) + offset;
    const glm::ivec3 base(glm::floor(at));
    glm::dvec3 sum(0.0);
    for_each(glm::ivec3(4), [&](glm::ivec3 tap) {
      const glm::ivec3 j = base + tap - 1;
      double weight = 1.0;
      for (int axis = 0; axis < 3; ++axis) {
        const double distance = at[axis] - j[axis];
        weight *= cubic * cubic_weight(distance) +
                  (1.0 - cubic) * std::max(0.0, 1.0 - std::abs(distance));
      }
      sum += weight * from.held(j);
    });
    to.at(i) = sum;
  });
  return to;
}

glm::ivec3 candidate_offset(int candidate, glm::ivec3 step) {
  glm::ivec3 offset(0);
  const int axis = candidate / shaders::kSlidingSteps % 3;
  const int side = candidate < 3 * shaders::kSlidingSteps ? 1 : -1;
  const int distance = candidate % shaders::kSlidingSteps + 1;
  offset[axis] = side * distance * step[axis];
  return offset;
}

Texels sliding_moments(const Scalars& fixed, const Scalars& moving, const Texels& packed,
                       const Vectors& field, glm::ivec3 cell, glm::dvec3 spacing_mm) {
  Texels result(field.size);
  for_each(field.size, [&](glm::ivec3 c) {
    glm::dvec4 sum(0.0);
    double count = 0.0;
    const glm::ivec3 begin = c * cell, end = glm::min(begin + cell, fixed.size);
    for_each(end - begin, [&](glm::ivec3 o) {
      bool taken = true;
      for (int axis = 0; axis < 3; ++axis)
        taken = taken && (o[axis] % 2 == 1 || end[axis] - begin[axis] == 1);
      if (!taken) return;
      const glm::ivec3 x = begin + o;
      const glm::dvec3 partner =
          glm::dvec3(x) + sample(field, cell_index(glm::dvec3(x), cell)) / spacing_mm;
      const double f = fixed.at(x);
      const double m =
          inside(partner, fixed.size) && inside_mask(packed.at(x)) ? sample(moving, partner) : f;
      sum += glm::dvec4(f, m, f * f, f * m);
      ++count;
    });
    result.at(c) = sum / count;
  });
  return result;
}

Scalars sliding_cost(const Scalars& fixed, const Scalars& moving, const Texels& packed,
                     const Texels& moments, const Vectors& own, const Vectors& v,
                     const SlidingCost& with) {
  Scalars result(own.size);
  const double f2 = with.noise * with.noise;
  for_each(own.size, [&](glm::ivec3 c) {
    const glm::dvec3 ratio = glm::dvec3(with.cell) / glm::dvec3(with.coarse_cell);
    const glm::dvec4 e = sample(moments, (glm::dvec3(c) + 0.5) * ratio - 0.5);
    const double gain = (e.w - e.x * e.y + f2) / (std::max(0.0, e.z - e.x * e.x) + f2);
    const double offset = e.y - gain * e.x;
    double sum = 0.0;
    const glm::ivec3 begin = c * with.cell, end = glm::min(begin + with.cell, fixed.size);
    for_each(end - begin, [&](glm::ivec3 o) {
      const glm::ivec3 x = begin + o;
      const glm::dvec3 own_partner = glm::dvec3(x) + own.at(c) / with.spacing_mm;
      const glm::dvec3 partner = glm::dvec3(x) + v.at(c) / with.spacing_mm;
      if (!inside(own_partner, fixed.size) || !inside_mask(packed.at(x))) return;
      const double d = gain * fixed.at(x) + offset - sample(moving, partner);
      sum += inside(partner, fixed.size) ? std::min(1.0, d * d / (with.limit * with.limit)) : 1.0;
    });
    result.at(c) = sum / (with.cell.x * with.cell.y * with.cell.z);
  });
  return result;
}

bool has_candidate(const Vectors& field, glm::ivec3 cell, int candidate, const AcrossBorder& with) {
  const glm::ivec3 offset = candidate_offset(candidate, with.step);
  const glm::ivec3 from = cell + offset;
  if (from != glm::clamp(from, glm::ivec3(0), field.size - 1)) return false;
  const double apart = glm::length(field.at(from) - field.at(cell));
  const double distance = glm::length(glm::dvec3(offset) * with.cell_mm);
  return apart >= with.apart_mm && apart >= with.slope * distance;
}

}  // namespace palpate::oracle
