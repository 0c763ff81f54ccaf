#include "compute/motion/bricks.h"

#include <algorithm>

namespace palpate {

BrickList bricks_over(glm::ivec3 begin, glm::ivec3 end) {
  const glm::ivec3 first = begin / shaders::kBrick, n = brick_count(end);
  BrickList bricks;
  for (int z = first.z; z < n.z; ++z) {
    for (int y = first.y; y < n.y; ++y) {
      for (int x = first.x; x < n.x; ++x)
        bricks.push_back(uint32_t(x) | uint32_t(y) << 10 | uint32_t(z) << 20);
    }
  }
  return bricks;
}

BrickList all_bricks(glm::ivec3 cells) {
  return bricks_over(glm::ivec3(0), cells);
}

vulkan::Buffer upload_bricks(const std::shared_ptr<vulkan::Context>& context,
                             const BrickList& bricks) {
  vulkan::Buffer buffer(context, std::max<size_t>(1, bricks.size()) * sizeof(uint32_t),
                        vulkan::Buffer::Kind::kFilledByHost);
  std::copy(bricks.begin(), bricks.end(), buffer.as<uint32_t>().begin());
  return buffer;
}

}  // namespace palpate
