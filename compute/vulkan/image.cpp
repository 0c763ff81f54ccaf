#include "compute/vulkan/image.h"

#include <utility>

namespace palpate::vulkan {

Image::Image(std::shared_ptr<Context> context, glm::ivec3 size, VkFormat format)
    : context_(std::move(context)), size_(size), format_(format) {
  const VkDevice device = context_->device();
  VkImageCreateInfo create{VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO};
  create.imageType = VK_IMAGE_TYPE_3D;
  create.format = format;
  create.extent = {uint32_t(size.x), uint32_t(size.y), uint32_t(size.z)};
  create.mipLevels = 1;
  create.arrayLayers = 1;
  create.samples = VK_SAMPLE_COUNT_1_BIT;
  create.tiling = VK_IMAGE_TILING_OPTIMAL;
  create.usage = VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_SAMPLED_BIT |
                 VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
  check(vkCreateImage(device, &create, nullptr, &image_), "creating an image");
  VkMemoryRequirements needed;
  vkGetImageMemoryRequirements(device, image_, &needed);
  try {
    memory_ = context_->allocate(needed, MemoryKind::kDevice);
    reserved_ = needed.size;
    check(vkBindImageMemory(device, image_, memory_, 0), "binding an image to memory");
    VkImageViewCreateInfo view{VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO};
    view.image = image_;
    view.viewType = VK_IMAGE_VIEW_TYPE_3D;
    view.format = format;
    view.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    check(vkCreateImageView(device, &view, nullptr, &view_), "creating an image view");
  } catch (...) {
    vkDestroyImage(device, image_, nullptr);
    if (memory_) context_->release(memory_, reserved_, MemoryKind::kDevice);
    throw;
  }
}

Image::~Image() {
  if (!image_) return;
  vkDestroyImageView(context_->device(), view_, nullptr);
  vkDestroyImage(context_->device(), image_, nullptr);
  context_->release(memory_, reserved_, MemoryKind::kDevice);
}

void Image::swap(Image& other) noexcept {
  std::swap(context_, other.context_);
  std::swap(image_, other.image_);
  std::swap(view_, other.view_);
  std::swap(memory_, other.memory_);
  std::swap(reserved_, other.reserved_);
  std::swap(size_, other.size_);
  std::swap(format_, other.format_);
}

Sampler::Sampler(std::shared_ptr<Context> context, VkFilter filter) : context_(std::move(context)) {
  VkSamplerCreateInfo create{VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO};
  create.magFilter = filter;
  create.minFilter = filter;
  create.mipmapMode = VK_SAMPLER_MIPMAP_MODE_NEAREST;
  create.addressModeU = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
  create.addressModeV = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
  create.addressModeW = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
  check(vkCreateSampler(context_->device(), &create, nullptr, &sampler_), "creating a sampler");
}

Sampler::~Sampler() {
  if (sampler_) vkDestroySampler(context_->device(), sampler_, nullptr);
}

void Sampler::swap(Sampler& other) noexcept {
  std::swap(context_, other.context_);
  std::swap(sampler_, other.sampler_);
}

}  // namespace palpate::vulkan
