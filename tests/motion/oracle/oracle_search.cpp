#include <algorithm>
#include <cmath>

#include "tests/motion/oracle/oracle.h"

namespace palpate::oracle {

glm::ivec3 label_of(int label, glm::ivec3 reach) {
  const glm::ivec3 width = 2 * reach + 1;
  return glm::ivec3(label % width.x, label / width.x % width.y, label / (width.x * width.y)) -
         reach;
}

std::vector<Scalars> matching_cost(const Texels& fixed, const Texels& moving, const Vectors& base,
                                   glm::ivec3 cell, glm::ivec3 reach, double cut) {
  const glm::ivec3 width = 2 * reach + 1;
  std::vector<Scalars> costs;
  for (int label = 0; label < width.x * width.y * width.z; ++label) {
    Scalars sum(cells_of(fixed.size, cell)), counted(sum.size);
    for_each(fixed.size, [&](glm::ivec3 x) {
      if (!inside_mask(fixed.at(x))) return;
      const glm::ivec3 partner =
          x + label_of(label, reach) + glm::ivec3(glm::round(base.at(x / cell)));
      const bool inside = partner == glm::clamp(partner, glm::ivec3(0), moving.size - 1);
      sum.at(x / cell) +=
          inside ? std::min(cut, std::abs(fixed.at(x).w - moving.at(partner).w)) : cut;
      counted.at(x / cell) += 1.0;
    });
    for (size_t i = 0; i < sum.values.size(); ++i)
      sum.values[i] /= std::max(1.0, counted.values[i]);
    costs.push_back(std::move(sum));
  }
  return costs;
}

Scalars smooth_cost(const Scalars& cost, const Scalars& listed, int axis) {
  glm::ivec3 step(0);
  step[axis] = 1;
  Scalars smooth(cost.size);
  for_each(cost.size, [&](glm::ivec3 i) {
    const auto beside = [&](glm::ivec3 k) {
      return listed.held(k) > 0.0 ? cost.held(k) : cost.at(i);
    };
    smooth.at(i) = 0.25 * beside(i - step) + 0.5 * cost.at(i) + 0.25 * beside(i + step);
  });
  return smooth;
}

double lowest_between(double before, double here, double after) {
  if (before <= here || after <= here) return 0.0;
  return 0.5 * (before - after) / (before + after - 2.0 * here);
}

Vectors choose(const Samples<NormalEquations>& now, const Samples<NormalEquations>& then,
               const Vectors& u, const Vectors& other, double least, double all, double flat) {
  Vectors chosen = u;
  for (size_t i = 0; i < u.values.size(); ++i) {
    const NormalEquations &a = now.values[i], &b = then.values[i];
    if (a.counted <= 0.01) continue;
    const double gain = (a.residual - b.residual - 2.0 * std::max(0.0, a.counted - b.counted)) /
                        (2.0 * a.structure + flat * a.counted);
    const double t = std::clamp((gain - least) / (all - least), 0.0, 1.0);
    chosen.values[i] += t * t * (3.0 - 2.0 * t) * (other.values[i] - u.values[i]);
  }
  return chosen;
}

double coupled_cost(const std::vector<Scalars>& cost, int label, glm::ivec3 node, glm::ivec3 reach,
                    glm::dvec3 u_voxels, double price) {
  const glm::dvec3 off = glm::dvec3(label_of(label, reach)) - u_voxels;
  return cost[size_t(label)].at(node) + price * glm::dot(off, off);
}

}  // namespace palpate::oracle
