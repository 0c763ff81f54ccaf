// The runtime's use of the program's Vulkan device.
#include <cmath>
#include <cstring>
#include <limits>

#include "tests/xr/runtime/world.h"

namespace palpate::test::fake {
namespace {

bool is_depth(const XrSwapchainCreateInfo& info) {
  return (info.usageFlags & XR_SWAPCHAIN_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT) != 0;
}

VkImageUsageFlags usage_of(XrSwapchainUsageFlags flags) {
  // The runtime itself reads from every image.
  VkImageUsageFlags usage = VK_IMAGE_USAGE_TRANSFER_SRC_BIT;
  const auto add = [&](XrSwapchainUsageFlags flag, VkImageUsageFlags bit) {
    if (flags & flag) usage |= bit;
  };
  add(XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT, VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT);
  add(XR_SWAPCHAIN_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT, VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT);
  add(XR_SWAPCHAIN_USAGE_UNORDERED_ACCESS_BIT, VK_IMAGE_USAGE_STORAGE_BIT);
  add(XR_SWAPCHAIN_USAGE_TRANSFER_SRC_BIT, VK_IMAGE_USAGE_TRANSFER_SRC_BIT);
  add(XR_SWAPCHAIN_USAGE_TRANSFER_DST_BIT, VK_IMAGE_USAGE_TRANSFER_DST_BIT);
  add(XR_SWAPCHAIN_USAGE_SAMPLED_BIT, VK_IMAGE_USAGE_SAMPLED_BIT);
  return usage;
}

uint32_t memory_type(const Session& session, uint32_t bits, VkMemoryPropertyFlags wanted) {
  VkPhysicalDeviceMemoryProperties properties;
  vkGetPhysicalDeviceMemoryProperties(session.physical, &properties);
  for (uint32_t i = 0; i < properties.memoryTypeCount; ++i)
    if ((bits >> i & 1U) && (properties.memoryTypes[i].propertyFlags & wanted) == wanted) return i;
  return 0;
}

/// One command buffer, run to its end.
class OneTime {
 public:
  explicit OneTime(Session& session) : session_(session) {
    VkCommandPoolCreateInfo pool{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
    pool.queueFamilyIndex = session.family;
    vkCreateCommandPool(session.device, &pool, nullptr, &pool_);
    VkCommandBufferAllocateInfo allocate{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
    allocate.commandPool = pool_;
    allocate.commandBufferCount = 1;
    vkAllocateCommandBuffers(session.device, &allocate, &commands);
    VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    vkBeginCommandBuffer(commands, &begin);
  }
  ~OneTime() { vkDestroyCommandPool(session_.device, pool_, nullptr); }

  void turn(VkImage image, bool depth, VkImageLayout from, VkImageLayout to) {
    VkImageMemoryBarrier barrier{VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER};
    barrier.srcAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
    barrier.oldLayout = from;
    barrier.newLayout = to;
    barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.image = image;
    barrier.subresourceRange = {
        VkImageAspectFlags(depth ? VK_IMAGE_ASPECT_DEPTH_BIT : VK_IMAGE_ASPECT_COLOR_BIT), 0,
        VK_REMAINING_MIP_LEVELS, 0, VK_REMAINING_ARRAY_LAYERS};
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT,
                         VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 0, nullptr, 0, nullptr, 1,
                         &barrier);
  }

  bool run() {
    vkEndCommandBuffer(commands);
    VkSubmitInfo submit{VK_STRUCTURE_TYPE_SUBMIT_INFO};
    submit.commandBufferCount = 1;
    submit.pCommandBuffers = &commands;
    return vkQueueSubmit(session_.queue, 1, &submit, VK_NULL_HANDLE) == VK_SUCCESS &&
           vkQueueWaitIdle(session_.queue) == VK_SUCCESS;
  }

  VkCommandBuffer commands = VK_NULL_HANDLE;

 private:
  Session& session_;
  VkCommandPool pool_ = VK_NULL_HANDLE;
};

float float_of_half(uint16_t bits) {
  const int exponent = bits >> 10 & 31, fraction = bits & 1023;
  const double size = exponent == 0    ? std::ldexp(fraction, -24)
                      : exponent == 31 ? std::numeric_limits<double>::infinity()
                                       : std::ldexp(1024 + fraction, exponent - 25);
  return float(bits >> 15 ? -size : size);
}

VkImageLayout shared_layout(bool depth) {
  return depth ? VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL
               : VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
}

}  // namespace

VkResult make_image(Session& session, const XrSwapchainCreateInfo& info, SwapchainImage& made) {
  VkImageCreateInfo create{VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO};
  create.imageType = VK_IMAGE_TYPE_2D;
  create.format = VkFormat(info.format);
  create.extent = {info.width, info.height, 1};
  create.mipLevels = info.mipCount;
  create.arrayLayers = info.arraySize;
  create.samples = VK_SAMPLE_COUNT_1_BIT;
  create.usage = usage_of(info.usageFlags);
  VkResult result = vkCreateImage(session.device, &create, nullptr, &made.image);
  if (result != VK_SUCCESS) return result;
  VkMemoryRequirements needs;
  vkGetImageMemoryRequirements(session.device, made.image, &needs);
  VkMemoryAllocateInfo allocate{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
  allocate.allocationSize = needs.size;
  allocate.memoryTypeIndex =
      memory_type(session, needs.memoryTypeBits, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
  result = vkAllocateMemory(session.device, &allocate, nullptr, &made.memory);
  if (result == VK_SUCCESS) result = vkBindImageMemory(session.device, made.image, made.memory, 0);
  if (result != VK_SUCCESS) return result;
  OneTime once(session);
  once.turn(made.image, is_depth(info), VK_IMAGE_LAYOUT_UNDEFINED, shared_layout(is_depth(info)));
  return once.run() ? VK_SUCCESS : VK_ERROR_DEVICE_LOST;
}

void destroy_image(Session& session, SwapchainImage& image) {
  vkDestroyImage(session.device, image.image, nullptr);
  vkFreeMemory(session.device, image.memory, nullptr);
  image = {};
}

bool read_back(Session& session, const Swapchain& chain, uint32_t layer, const XrRect2Di& rect,
               std::vector<uint32_t>& words) {
  const bool depth = is_depth(chain.info);
  const VkImage image = chain.images[size_t(chain.last_released)].image;
  const bool halves = chain.info.format == VK_FORMAT_R16G16B16A16_SFLOAT;
  words.resize(size_t(rect.extent.width) * size_t(rect.extent.height) * (halves ? 2 : 1));
  VkBufferCreateInfo create{VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
  create.size = words.size() * sizeof(uint32_t);
  create.usage = VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  VkBuffer buffer = VK_NULL_HANDLE;
  if (vkCreateBuffer(session.device, &create, nullptr, &buffer) != VK_SUCCESS) return false;
  VkMemoryRequirements needs;
  vkGetBufferMemoryRequirements(session.device, buffer, &needs);
  VkMemoryAllocateInfo allocate{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
  allocate.allocationSize = needs.size;
  allocate.memoryTypeIndex =
      memory_type(session, needs.memoryTypeBits,
                  VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
  VkDeviceMemory memory = VK_NULL_HANDLE;
  bool done = vkAllocateMemory(session.device, &allocate, nullptr, &memory) == VK_SUCCESS &&
              vkBindBufferMemory(session.device, buffer, memory, 0) == VK_SUCCESS;
  if (done) {
    OneTime once(session);
    // The layout in which the program must leave the image; validation layers report any other.
    once.turn(image, depth, shared_layout(depth), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
    VkBufferImageCopy region{};
    region.imageSubresource = {
        VkImageAspectFlags(depth ? VK_IMAGE_ASPECT_DEPTH_BIT : VK_IMAGE_ASPECT_COLOR_BIT), 0, layer,
        1};
    region.imageOffset = {rect.offset.x, rect.offset.y, 0};
    region.imageExtent = {uint32_t(rect.extent.width), uint32_t(rect.extent.height), 1};
    vkCmdCopyImageToBuffer(once.commands, image, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, buffer, 1,
                           &region);
    VkMemoryBarrier to_host{VK_STRUCTURE_TYPE_MEMORY_BARRIER};
    to_host.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
    to_host.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
    vkCmdPipelineBarrier(once.commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_HOST_BIT,
                         0, 1, &to_host, 0, nullptr, 0, nullptr);
    once.turn(image, depth, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, shared_layout(depth));
    done = once.run();
  }
  void* mapped = nullptr;
  done = done && vkMapMemory(session.device, memory, 0, create.size, 0, &mapped) == VK_SUCCESS;
  if (done) std::memcpy(words.data(), mapped, create.size);
  vkDestroyBuffer(session.device, buffer, nullptr);
  vkFreeMemory(session.device, memory, nullptr);
  return done;
}

double linear_of_srgb(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

std::vector<std::array<float, 4>> light_of(VkFormat format, const std::vector<uint32_t>& words) {
  // A power for each channel of each pixel of each frame would take longer than what is tested.
  static const std::array<float, 256> linear_of_byte = [] {
    std::array<float, 256> linear{};
    for (size_t k = 0; k < linear.size(); ++k) linear[k] = float(linear_of_srgb(double(k) / 255.0));
    return linear;
  }();
  const bool halves = format == VK_FORMAT_R16G16B16A16_SFLOAT;
  const bool encoded = format == VK_FORMAT_R8G8B8A8_SRGB || format == VK_FORMAT_B8G8R8A8_SRGB;
  const bool blue_first = format == VK_FORMAT_B8G8R8A8_SRGB || format == VK_FORMAT_B8G8R8A8_UNORM;
  std::vector<std::array<float, 4>> light;
  light.reserve(words.size());
  for (size_t at = 0; at < words.size(); at += halves ? 2 : 1) {
    std::array<float, 4> pixel{};
    for (size_t c = 0; c < 4; ++c) {
      if (halves) {
        pixel[c] = float_of_half(uint16_t(words[at + c / 2] >> 16 * (c % 2)));
        continue;
      }
      const uint32_t byte = words[at] >> 8 * c & 255U;
      pixel[c] = encoded && c < 3 ? linear_of_byte[byte] : float(byte / 255.0);
    }
    if (blue_first) std::swap(pixel[0], pixel[2]);
    light.push_back(pixel);
  }
  return light;
}

}  // namespace palpate::test::fake
