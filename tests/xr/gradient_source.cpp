#include "tests/xr/gradient_source.h"

#include <limits>
#include <utility>

namespace palpate::test {

Status GradientSource::use(const std::shared_ptr<vulkan::Context>& context) {
  if (refuse) return Error{ErrorKind::kDeviceFailed, "The test wants no device."};
  ++uses;
  context_ = context;
  return Nothing{};
}

void GradientSource::drop() noexcept {
  ++drops;
  color_ = {};
  depth_ = {};
  context_.reset();
}

Result<xr::Drawn> GradientSource::record(const xr::HeadsetFrame& frame, VkCommandBuffer commands) {
  ++frames;
  last = frame;
  hands = *frame.hands;
  hidden = frame.eyes[0].hidden->vertices;
  hidden_triangles.clear();
  for (const xr::EyeView& eye : frame.eyes)
    hidden_triangles.push_back(eye.hidden->triangles.size());
  if (on_frame) on_frame(frame);
  if (fails_once) return *std::exchange(fails_once, {});
  xr::Drawn drawn;
  drawn.color = with_color;
  if (!with_color) return drawn;
  const VkExtent2D size = frame.color.size;
  const auto eyes = uint32_t(frame.eyes.size());
  const size_t pixels = size_t(size.width) * size.height * eyes;
  // Enough for formats of eight bytes a pixel, too, in which the picture makes no sense.
  if (color_.bytes() != pixels * sizeof(uint64_t)) {
    color_ =
        vulkan::Buffer(context_, pixels * sizeof(uint64_t), vulkan::Buffer::Kind::kHostVisible);
    depth_ = vulkan::Buffer(context_, pixels * sizeof(float), vulkan::Buffer::Kind::kHostVisible);
  }
  const auto color = color_.as<uint32_t>();
  const auto depth = depth_.as<float>();
  for (uint32_t eye = 0, at = 0; eye < eyes; ++eye)
    for (uint32_t y = 0; y < size.height; ++y)
      for (uint32_t x = 0; x < size.width; ++x, ++at) {
        color[at] = color_at(eye, x, y);
        depth[at] = depth_at(eye, y);
      }
  VkBufferImageCopy region{};
  region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, eyes};
  region.imageExtent = {size.width, size.height, 1};
  vkCmdCopyBufferToImage(commands, color_.handle(), frame.color.image,
                         VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
  if (!with_depth || !frame.depth.image) return drawn;
  region.imageSubresource.aspectMask = VK_IMAGE_ASPECT_DEPTH_BIT;
  vkCmdCopyBufferToImage(commands, depth_.handle(), frame.depth.image,
                         VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
  drawn.depth = true;
  drawn.depth_0_m = std::numeric_limits<float>::infinity();
  drawn.depth_1_m = 0.05F;
  return drawn;
}

}  // namespace palpate::test
