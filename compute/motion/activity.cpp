#include "compute/motion/activity.h"

#include <cassert>

namespace palpate {

BrickList active_bricks(const BrickList& bricks, std::span<const BrickMeasure> measures,
                        glm::ivec3 cells, const RestRule& rule) {
  assert(measures.size() >= bricks.size());
  const glm::ivec3 n = brick_count(cells);
  std::vector<bool> near_motion(size_t(n.x) * size_t(n.y) * size_t(n.z), false);
  const auto at = [&](glm::ivec3 b) {
    return size_t(b.x) + size_t(n.x) * (size_t(b.y) + size_t(n.y) * size_t(b.z));
  };
  for (size_t i = 0; i < bricks.size(); ++i) {
    if (double(measures[i].moved) < rule.moved) continue;
    // The window and the filter carry motion into the neighbours.
    const glm::ivec3 b = unpacked(bricks[i]);
    for (int k = 0; k < 27; ++k) {
      const glm::ivec3 next = b + glm::ivec3(k % 3, k / 3 % 3, k / 9) - 1;
      const bool inside =
          next.x >= 0 && next.y >= 0 && next.z >= 0 && next.x < n.x && next.y < n.y && next.z < n.z;
      if (inside) near_motion[at(next)] = true;
    }
  }
  BrickList active;
  for (size_t i = 0; i < bricks.size(); ++i) {
    const bool empty =
        double(measures[i].structure) < rule.structure && double(measures[i].reach) < rule.reach;
    const bool masked_out = measures[i].structure == 0.0F;
    if (near_motion[at(unpacked(bricks[i]))] && !empty && !masked_out) active.push_back(bricks[i]);
  }
  return active;
}

}  // namespace palpate
