#include <algorithm>
#include <cmath>

#include "compute/motion/oracle.h"

namespace palpate::oracle {

glm::ivec3 label_of(int label, glm::ivec3 reach) {
  const glm::ivec3 width = 2 * reach + 1;
  return glm::ivec3(label % width.x, label / width.x % width.y, label / (width.x * width.y)) -
         reach;
}

std::vector<Scalars> matching_cost(const Texels& fixed, const Texels& moving, glm::ivec3 cell,
                                   glm::ivec3 reach, double cut) {
  const glm::ivec3 width = 2 * reach + 1;
  std::vector<Scalars> costs;
  for (int label = 0; label < width.x * width.y * width.z; ++label) {
    Scalars sum(cells_of(fixed.size, cell)), counted(sum.size);
    for_each(fixed.size, [&](glm::ivec3 x) {
      if (!inside_mask(fixed.at(x))) return;
      const glm::ivec3 partner = x + label_of(label, reach);
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

Scalars smooth_cost(const Scalars& cost, int axis) {
  glm::ivec3 step(0);
  step[axis] = 1;
  Scalars smooth(cost.size);
  for_each(cost.size, [&](glm::ivec3 i) {
    smooth.at(i) = 0.25 * cost.held(i - step) + 0.5 * cost.at(i) + 0.25 * cost.held(i + step);
  });
  return smooth;
}

double coupled_cost(const std::vector<Scalars>& cost, int label, glm::ivec3 node, glm::ivec3 reach,
                    glm::dvec3 u_voxels, double price) {
  const glm::dvec3 off = glm::dvec3(label_of(label, reach)) - u_voxels;
  return cost[size_t(label)].at(node) + price * glm::dot(off, off);
}

}  // namespace palpate::oracle
