#include "compute/vulkan/buffer.h"

#include <cassert>
#include <utility>

namespace palpate::vulkan {

Buffer::Buffer(std::shared_ptr<Context> context, uint64_t bytes, Kind kind)
    : context_(std::move(context)), bytes_(bytes), kind_(kind) {
  VkBufferCreateInfo create{VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
  create.size = bytes;
  create.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
                 VK_BUFFER_USAGE_TRANSFER_DST_BIT | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT |
                 VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT;
  const VkDevice device = context_->device();
  check(vkCreateBuffer(device, &create, nullptr, &buffer_), "creating a buffer");
  VkMemoryRequirements needed;
  vkGetBufferMemoryRequirements(device, buffer_, &needed);
  try {
    memory_ = context_->allocate(needed, kind);
    reserved_ = needed.size;
    check(vkBindBufferMemory(device, buffer_, memory_, 0), "binding a buffer to memory");
    if (kind != Kind::kDevice) {
      check(vkMapMemory(device, memory_, 0, VK_WHOLE_SIZE, 0, &mapped_), "mapping a buffer");
    }
  } catch (...) {
    vkDestroyBuffer(device, buffer_, nullptr);
    if (memory_) context_->release(memory_, reserved_, kind);
    throw;
  }
}

Buffer::~Buffer() {
  if (!buffer_) return;
  vkDestroyBuffer(context_->device(), buffer_, nullptr);
  context_->release(memory_, reserved_, kind_);
}

void Buffer::swap(Buffer& other) noexcept {
  std::swap(context_, other.context_);
  std::swap(buffer_, other.buffer_);
  std::swap(memory_, other.memory_);
  std::swap(bytes_, other.bytes_);
  std::swap(reserved_, other.reserved_);
  std::swap(mapped_, other.mapped_);
  std::swap(kind_, other.kind_);
}

TexelView::TexelView(std::shared_ptr<Context> context, const Buffer& buffer, VkFormat format)
    : context_(std::move(context)) {
  VkBufferViewCreateInfo create{VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO};
  create.buffer = buffer.handle();
  create.format = format;
  assert((format == VK_FORMAT_R32_UINT || format == VK_FORMAT_R32G32B32A32_SFLOAT) &&
         "no kernel reads texels of another format");
  const uint64_t texel_bytes = format == VK_FORMAT_R32_UINT ? 4 : 16;
  const uint64_t most_bytes = context_->limits().maxTexelBufferElements * texel_bytes;
  whole_ = buffer.bytes() <= most_bytes;
  create.range = whole_ ? VK_WHOLE_SIZE : most_bytes;
  check(vkCreateBufferView(context_->device(), &create, nullptr, &view_), "viewing a buffer");
}

TexelView::~TexelView() {
  if (view_) vkDestroyBufferView(context_->device(), view_, nullptr);
}

void TexelView::swap(TexelView& other) noexcept {
  std::swap(context_, other.context_);
  std::swap(view_, other.view_);
  std::swap(whole_, other.whole_);
}

}  // namespace palpate::vulkan
