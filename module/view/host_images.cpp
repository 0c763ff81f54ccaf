#include "module/view/host_images.h"

#include <cmath>

namespace palpate {
namespace {

bool is_swapped(VkFormat format) {
  return format == VK_FORMAT_B8G8R8A8_SRGB || format == VK_FORMAT_B8G8R8A8_UNORM;
}

bool is_24_bit(VkFormat format) {
  return format == VK_FORMAT_X8_D24_UNORM_PACK32 || format == VK_FORMAT_D24_UNORM_S8_UINT;
}

bool has_stencil(VkFormat format) {
  return format == VK_FORMAT_D32_SFLOAT_S8_UINT || format == VK_FORMAT_D24_UNORM_S8_UINT;
}

/// One image of an eye, and where it is copied from or to.
struct CopiedImage {
  VkImage image = VK_NULL_HANDLE;
  VkImageAspectFlags copied = VK_IMAGE_ASPECT_COLOR_BIT;  ///< what is copied ...
  VkImageAspectFlags all = VK_IMAGE_ASPECT_COLOR_BIT;     ///< ... and what changes its layout
  VkImageLayout layout = VK_IMAGE_LAYOUT_UNDEFINED;       ///< of the host's
  uint32_t layer = 0;
};

CopiedImage colour_of(const HostImages& images, int eye) {
  const HostImages::OfEye& of = images.eyes[size_t(eye)];
  return {of.colour, VK_IMAGE_ASPECT_COLOR_BIT, VK_IMAGE_ASPECT_COLOR_BIT, images.colour_layout,
          of.colour_layer};
}

CopiedImage depth_of(const HostImages& images, int eye) {
  const HostImages::OfEye& of = images.eyes[size_t(eye)];
  const VkImageAspectFlags stencil =
      has_stencil(images.depth_format) ? VK_IMAGE_ASPECT_STENCIL_BIT : 0;
  return {of.depth, VK_IMAGE_ASPECT_DEPTH_BIT, VK_IMAGE_ASPECT_DEPTH_BIT | stencil,
          images.depth_layout, of.depth_layer};
}

void change_layout(VkCommandBuffer commands, const CopiedImage& part, VkImageLayout from,
                   VkImageLayout to) {
  VkImageMemoryBarrier change{VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER};
  change.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT;
  change.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
  change.oldLayout = from;
  change.newLayout = to;
  change.srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  change.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  change.image = part.image;
  change.subresourceRange = {part.all, 0, 1, part.layer, 1};
  // And of the buffer that is copied to or from.
  VkMemoryBarrier memory{VK_STRUCTURE_TYPE_MEMORY_BARRIER};
  memory.srcAccessMask = change.srcAccessMask;
  memory.dstAccessMask = change.dstAccessMask;
  vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT,
                       VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 1, &memory, 0, nullptr, 1, &change);
}

VkBufferImageCopy region_of(const CopiedImage& part, PictureSize size, uint64_t first_pixel) {
  VkBufferImageCopy region{};
  region.bufferOffset = 4 * first_pixel;
  region.imageSubresource = {part.copied, 0, part.layer, 1};
  region.imageExtent = {uint32_t(size.width), uint32_t(size.height), 1};
  return region;
}

void copy_from(VkCommandBuffer commands, const CopiedImage& part, PictureSize size, VkBuffer to,
               uint64_t first_pixel) {
  constexpr VkImageLayout kSource = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
  change_layout(commands, part, part.layout, kSource);
  const VkBufferImageCopy region = region_of(part, size, first_pixel);
  vkCmdCopyImageToBuffer(commands, part.image, kSource, to, 1, &region);
  change_layout(commands, part, kSource, part.layout);
}

void copy_into(VkCommandBuffer commands, const CopiedImage& part, PictureSize size, VkBuffer from,
               uint64_t first_pixel) {
  constexpr VkImageLayout kTarget = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
  change_layout(commands, part, part.layout, kTarget);
  const VkBufferImageCopy region = region_of(part, size, first_pixel);
  vkCmdCopyBufferToImage(commands, from, part.image, kTarget, 1, &region);
  change_layout(commands, part, kTarget, part.layout);
}

uint64_t pixels_of(PictureSize size) {
  return uint64_t(size.width) * uint64_t(size.height);
}

}  // namespace

bool HostImages::takes_colour(VkFormat format) {
  return format == VK_FORMAT_R8G8B8A8_SRGB || format == VK_FORMAT_R8G8B8A8_UNORM ||
         is_swapped(format);
}

bool HostImages::takes_depth(VkFormat format) {
  return format == VK_FORMAT_D32_SFLOAT || format == VK_FORMAT_D32_SFLOAT_S8_UINT ||
         is_24_bit(format);
}

namespace view {

Status check(const HostImages& images, int eyes) {
  const auto refused = [](const char* sentence) {
    return Status(Error{ErrorKind::kBadInput, sentence});
  };
  if (!HostImages::takes_colour(images.colour_format))
    return refused(
        "The host's colour images have a format that can not be drawn into: it takes 8 bits of R, "
        "G, B and A in either order.");
  int depths = 0;
  for (int eye = 0; eye < eyes; ++eye) {
    if (!images.eyes[size_t(eye)].colour)
      return refused("An eye has no colour image of the host's.");
    depths += images.eyes[size_t(eye)].depth != VK_NULL_HANDLE;
  }
  if (depths != 0 && depths != eyes)
    return refused("One eye has a depth image of the host's and the other has none.");
  if (depths == 0) return Nothing{};
  if (!HostImages::takes_depth(images.depth_format))
    return refused(
        "The host's depth images have a format that can not be read: it takes D32_SFLOAT, "
        "D32_SFLOAT_S8_UINT, X8_D24_UNORM_PACK32 or D24_UNORM_S8_UINT.");
  if (!(images.inverse_depth_0 >= 0.0) || !(images.inverse_depth_1 >= 0.0) ||
      !std::isfinite(images.inverse_depth_0) || !std::isfinite(images.inverse_depth_1) ||
      images.inverse_depth_0 == images.inverse_depth_1)
    return refused(
        "What the host's depths mean is not said: the inverse depths of 0 and 1 must differ.");
  return Nothing{};
}

uint32_t backdrop_bits(const HostImages& images) {
  return 1U | (is_swapped(images.colour_format) ? 2U : 0U) |
         (is_24_bit(images.depth_format) ? 4U : 0U) | (images.eyes[0].depth ? 8U : 0U);
}

void record_from(const HostImages& images, int eyes, PictureSize size, vulkan::Recorder& recorder,
                 const vulkan::Buffer& backdrop) {
  const uint64_t pixels = pixels_of(size);
  for (int eye = 0; eye < eyes; ++eye) {
    copy_from(recorder.commands(), colour_of(images, eye), size, backdrop.handle(),
              uint64_t(eye) * pixels);
    if (images.eyes[size_t(eye)].depth)
      copy_from(recorder.commands(), depth_of(images, eye), size, backdrop.handle(),
                uint64_t(eyes + eye) * pixels);
  }
}

void record_into(const HostImages& images, int eyes, PictureSize size, vulkan::Recorder& recorder,
                 const vulkan::Buffer& colour, const vulkan::Buffer& depth) {
  const uint64_t pixels = pixels_of(size);
  for (int eye = 0; eye < eyes; ++eye) {
    copy_into(recorder.commands(), colour_of(images, eye), size, colour.handle(),
              uint64_t(eye) * pixels);
    if (images.writes_depth && images.eyes[size_t(eye)].depth)
      copy_into(recorder.commands(), depth_of(images, eye), size, depth.handle(),
                uint64_t(eye) * pixels);
  }
}

}  // namespace view
}  // namespace palpate
