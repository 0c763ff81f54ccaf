#pragma once

#include <cassert>
#include <memory>
#include <span>

#include "compute/vulkan/context.h"

namespace palpate::vulkan {

/// A buffer of any use with its own memory. All kinds but kDevice stay mapped. Move-only. Its
/// memory is freed with the object; the device must have finished with it. Creation throws Failure.
class Buffer {
 public:
  using Kind = MemoryKind;

  Buffer() = default;
  Buffer(std::shared_ptr<Context> context, uint64_t bytes, Kind kind = Kind::kDevice);
  Buffer(Buffer&& other) noexcept { swap(other); }
  Buffer& operator=(Buffer&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Buffer();

  VkBuffer handle() const { return buffer_; }
  uint64_t bytes() const { return bytes_; }
  explicit operator bool() const { return buffer_ != VK_NULL_HANDLE; }

  /// The mapped memory as values of T. Reading kFilledByHost is slow.
  template <class T>
  std::span<T> as() {
    assert(mapped_ && "device memory is not mapped");
    return {static_cast<T*>(mapped_), bytes_ / sizeof(T)};
  }

 private:
  void swap(Buffer& other) noexcept;

  std::shared_ptr<Context> context_;
  VkBuffer buffer_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  uint64_t bytes_ = 0;
  uint64_t reserved_ = 0;
  void* mapped_ = nullptr;
  Kind kind_ = Kind::kDevice;
};

/// A buffer as texels of a format (R32_UINT or R32G32B32A32_SFLOAT), for kernels that read single
/// texels (BindingKind::kTexels). Contains as many texels as the device allows, from the first on;
/// Vulkan guarantees 65536. The buffer must outlive it. Move-only. Creation throws Failure.
class TexelView {
 public:
  TexelView() = default;
  TexelView(std::shared_ptr<Context> context, const Buffer& buffer, VkFormat format);
  TexelView(TexelView&& other) noexcept { swap(other); }
  TexelView& operator=(TexelView&& other) noexcept {
    swap(other);
    return *this;
  }
  ~TexelView();
  VkBufferView handle() const { return view_; }
  /// False if the device allows fewer texels than the buffer has: kernels must then read the buffer
  /// itself.
  bool whole() const { return whole_; }

 private:
  void swap(TexelView& other) noexcept;

  std::shared_ptr<Context> context_;
  VkBufferView view_ = VK_NULL_HANDLE;
  bool whole_ = true;
};

}  // namespace palpate::vulkan
