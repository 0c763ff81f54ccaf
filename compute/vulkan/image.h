#pragma once

#include <glm/glm.hpp>
#include <memory>

#include "compute/vulkan/context.h"

namespace palpate::vulkan {

/// A 3D image that kernels sample and write. Always in layout GENERAL after its first recorder has
/// run (Recorder::prepare). Move-only. Creation throws Failure.
class Image {
 public:
  Image() = default;
  Image(std::shared_ptr<Context> context, glm::ivec3 size, VkFormat format);
  Image(Image&& other) noexcept { swap(other); }
  Image& operator=(Image&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Image();

  VkImage handle() const { return image_; }
  VkImageView view() const { return view_; }
  glm::ivec3 size() const { return size_; }
  size_t count() const { return size_t(size_.x) * size_t(size_.y) * size_t(size_.z); }
  VkFormat format() const { return format_; }
  explicit operator bool() const { return image_ != VK_NULL_HANDLE; }

 private:
  void swap(Image& other) noexcept;

  std::shared_ptr<Context> context_;
  VkImage image_ = VK_NULL_HANDLE;
  VkImageView view_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  uint64_t reserved_ = 0;
  glm::ivec3 size_{0};
  VkFormat format_ = VK_FORMAT_UNDEFINED;
};

/// The sampler through which kernels read images: normalised coordinates, clamp to edge, nearest or
/// linear.
class Sampler {
 public:
  Sampler() = default;
  Sampler(std::shared_ptr<Context> context, VkFilter filter);
  Sampler(Sampler&& other) noexcept { swap(other); }
  Sampler& operator=(Sampler&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Sampler();
  VkSampler handle() const { return sampler_; }

 private:
  void swap(Sampler& other) noexcept;

  std::shared_ptr<Context> context_;
  VkSampler sampler_ = VK_NULL_HANDLE;
};

}  // namespace palpate::vulkan
