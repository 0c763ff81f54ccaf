#include "compute/motion/bricks.h"

#include <algorithm>

namespace palpate {

BrickList all_bricks(glm::ivec3 cells) {
  const glm::ivec3 n = brick_count(cells);
  BrickList bricks;
  bricks.reserve(size_t(n.x) * size_t(n.y) * size_t(n.z));
  for (int z = 0; z < n.z; ++z) {
    for (int y = 0; y < n.y; ++y) {
      for (int x = 0; x < n.x; ++x)
        bricks.push_back(uint32_t(x) | uint32_t(y) << 10 | uint32_t(z) << 20);
    }
  }
  return bricks;
}

vulkan::Buffer upload_bricks(const std::shared_ptr<vulkan::Context>& context,
                             const BrickList& bricks) {
  vulkan::Buffer buffer(context, std::max<size_t>(1, bricks.size()) * sizeof(uint32_t),
                        vulkan::Buffer::Kind::kHostVisible);
  std::copy(bricks.begin(), bricks.end(), buffer.as<uint32_t>().begin());
  return buffer;
}

}  // namespace palpate
