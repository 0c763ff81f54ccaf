#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "compute/vulkan/buffer.h"
#include "shaders/interface/motion.h"

namespace palpate {

/// Bricks of 8^3 cells, packed as the kernels read them (x | y << 10 | z << 20).
using BrickList = std::vector<uint32_t>;

/// Sizes and indices as push constants store them.
inline glm::ivec4 wide(glm::ivec3 v, int w = 0) {
  return {v, w};
}

inline glm::ivec3 brick_count(glm::ivec3 cells) {
  return (cells + shaders::kBrick - 1) / shaders::kBrick;
}

/// Index of a brick, in bricks.
inline glm::ivec3 unpacked(uint32_t brick) {
  return {int(brick & 1023U), int(brick >> 10 & 1023U), int(brick >> 20)};
}

/// The bricks that contain any of the cells [begin, end).
BrickList bricks_over(glm::ivec3 begin, glm::ivec3 end);
/// Every brick of a grid of cells.
BrickList all_bricks(glm::ivec3 cells);

/// The listed bricks and those that touch them (26 neighbours), in the order of all_bricks().
BrickList with_neighbours(const BrickList& bricks, glm::ivec3 cells);

/// A device buffer with the list; never empty, so that it can always be bound.
vulkan::Buffer upload_bricks(const std::shared_ptr<vulkan::Context>& context,
                             const BrickList& bricks);

/// Workgroups of a kernel in which one group computes one slice of one brick.
inline glm::ivec3 slice_groups(const BrickList& bricks) {
  return {int(bricks.size()), shaders::kBrick, 1};
}
/// Workgroups of a kernel in which one group computes a whole brick.
inline glm::ivec3 brick_groups(const BrickList& bricks) {
  return {int(bricks.size()), 1, 1};
}

}  // namespace palpate
