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

BrickList with_neighbours(const BrickList& bricks, glm::ivec3 cells) {
  const glm::ivec3 n = brick_count(cells);
  const BrickList all = all_bricks(cells);  // x fastest
  std::vector<bool> wanted(all.size());
  for (const uint32_t brick : bricks) {
    const glm::ivec3 begin = glm::max(unpacked(brick) - 1, glm::ivec3(0));
    const glm::ivec3 end = glm::min(unpacked(brick) + 2, n);
    for (int z = begin.z; z < end.z; ++z)
      for (int y = begin.y; y < end.y; ++y)
        for (int x = begin.x; x < end.x; ++x)
          wanted[size_t(x) + size_t(n.x) * (size_t(y) + size_t(n.y) * size_t(z))] = true;
  }
  BrickList result;
  for (size_t i = 0; i < all.size(); ++i)
    if (wanted[i]) result.push_back(all[i]);
  return result;
}

vulkan::Buffer upload_bricks(const std::shared_ptr<vulkan::Context>& context,
                             const BrickList& bricks) {
  vulkan::Buffer buffer(context, std::max<size_t>(1, bricks.size()) * sizeof(uint32_t),
                        vulkan::Buffer::Kind::kFilledByHost);
  std::copy(bricks.begin(), bricks.end(), buffer.as<uint32_t>().begin());
  return buffer;
}

}  // namespace palpate
