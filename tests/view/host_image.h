#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "compute/vulkan/buffer.h"
#include "compute/vulkan/context.h"
#include "compute/vulkan/recorder.h"
#include "module/view/eye.h"

namespace palpate::test {

/// A host's image with two layers, to be filled and read back.
class HostImage {
 public:
  HostImage(std::shared_ptr<vulkan::Context> context, PictureSize size, VkFormat format,
            VkImageAspectFlags aspect, VkImageLayout layout)
      : context_(std::move(context)), size_(size), aspect_(aspect), layout_(layout) {
    VkImageCreateInfo create{VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO};
    create.imageType = VK_IMAGE_TYPE_2D;
    create.format = format;
    create.extent = {uint32_t(size_.width), uint32_t(size_.height), 1};
    create.mipLevels = 1;
    create.arrayLayers = 2;
    create.samples = VK_SAMPLE_COUNT_1_BIT;
    create.usage =
        VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT |
        (aspect == VK_IMAGE_ASPECT_COLOR_BIT ? VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT
                                             : VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT);
    vulkan::check(vkCreateImage(context_->device(), &create, nullptr, &image_), "making an image");
    VkMemoryRequirements needed;
    vkGetImageMemoryRequirements(context_->device(), image_, &needed);
    bytes_ = needed.size;
    memory_ = context_->allocate(needed, vulkan::MemoryKind::kDevice);
    vulkan::check(vkBindImageMemory(context_->device(), image_, memory_, 0), "binding an image");
    staged_ = vulkan::Buffer(context_, 4 * pixels(), vulkan::MemoryKind::kHostVisible);
  }
  ~HostImage() {
    vkDestroyImage(context_->device(), image_, nullptr);
    context_->release(memory_, bytes_, vulkan::MemoryKind::kDevice);
  }
  HostImage(const HostImage&) = delete;
  HostImage& operator=(const HostImage&) = delete;

  size_t pixels() const { return size_t(size_.width) * size_t(size_.height); }
  VkImage handle() const { return image_; }

  void fill(uint32_t layer, const std::vector<uint32_t>& words) {
    std::copy(words.begin(), words.end(), staged_.as<uint32_t>().begin());
    transfer(layer, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
             [&](VkCommandBuffer commands, const VkBufferImageCopy& region) {
               vkCmdCopyBufferToImage(commands, staged_.handle(), image_,
                                      VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
             });
  }
  std::vector<uint32_t> read(uint32_t layer) {
    transfer(layer, layout_, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL,
             [&](VkCommandBuffer commands, const VkBufferImageCopy& region) {
               vkCmdCopyImageToBuffer(commands, image_, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL,
                                      staged_.handle(), 1, &region);
             });
    const auto words = staged_.as<uint32_t>();
    return {words.begin(), words.begin() + std::ptrdiff_t(pixels())};
  }

 private:
  template <class Copy>
  void transfer(uint32_t layer, VkImageLayout from, VkImageLayout through, const Copy& copy) {
    vulkan::Recorder recorder(context_, 1);
    barrier(recorder.commands(), layer, from, through);
    VkBufferImageCopy region{};
    region.imageSubresource = {aspect_, 0, layer, 1};
    region.imageExtent = {uint32_t(size_.width), uint32_t(size_.height), 1};
    copy(recorder.commands(), region);
    barrier(recorder.commands(), layer, through, layout_);
    recorder.run();
  }
  void barrier(VkCommandBuffer commands, uint32_t layer, VkImageLayout from, VkImageLayout to) {
    VkImageMemoryBarrier change{VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER};
    change.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT;
    change.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
    change.oldLayout = from;
    change.newLayout = to;
    change.srcQueueFamilyIndex = change.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    change.image = image_;
    change.subresourceRange = {aspect_, 0, 1, layer, 1};
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT,
                         VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 0, nullptr, 0, nullptr, 1, &change);
  }

  std::shared_ptr<vulkan::Context> context_;
  PictureSize size_;
  VkImageAspectFlags aspect_;
  VkImageLayout layout_;

  VkImage image_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  uint64_t bytes_ = 0;
  vulkan::Buffer staged_;
};

}  // namespace palpate::test
