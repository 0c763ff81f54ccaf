#include "compute/vulkan/recorder.h"

#include <array>
#include <cassert>
#include <iterator>

namespace palpate::vulkan {
namespace {

constexpr uint32_t kMaxStamps = 256;
constexpr uint32_t kMaxBindingsPerDispatch = 22;

/// Writes what a kernel's bindings refer to into its descriptor set.
void write_set(VkDevice device, VkDescriptorSet set, const Kernel& kernel,
               const std::vector<Binding>& bindings) {
  std::array<VkDescriptorBufferInfo, kMaxBindingsPerDispatch> buffers;
  std::array<VkBufferView, kMaxBindingsPerDispatch> views;
  std::array<VkDescriptorImageInfo, kMaxBindingsPerDispatch> images;
  std::array<VkWriteDescriptorSet, kMaxBindingsPerDispatch> writes;
  for (size_t i = 0; i < bindings.size(); ++i) {
    VkWriteDescriptorSet& write = writes[i];
    write = {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
    write.dstSet = set;
    write.dstBinding = uint32_t(i);
    write.descriptorCount = 1;
    const Binding& bound = bindings[i];
    switch (kernel.bindings()[i]) {
      case BindingKind::kBuffer:
        assert(bound.buffer && "this binding takes a buffer");
        buffers[i] = {bound.buffer->handle(), 0, VK_WHOLE_SIZE};
        write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        write.pBufferInfo = &buffers[i];
        break;
      case BindingKind::kUniform:
        assert(bound.buffer && "this binding takes a buffer");
        buffers[i] = {bound.buffer->handle(), 0, VK_WHOLE_SIZE};
        write.descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
        write.pBufferInfo = &buffers[i];
        break;
      case BindingKind::kTexels:
        assert(bound.texels && "this binding takes a view of a buffer");
        views[i] = bound.texels->handle();
        write.descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
        write.pTexelBufferView = &views[i];
        break;
      case BindingKind::kStorageImage:
        assert(bound.image && "this binding takes an image");
        images[i] = {VK_NULL_HANDLE, bound.image->view(), VK_IMAGE_LAYOUT_GENERAL};
        write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
        write.pImageInfo = &images[i];
        break;
      case BindingKind::kSampledImage:
        assert(bound.image && bound.sampler && "this binding takes an image with a sampler");
        images[i] = {bound.sampler->handle(), bound.image->view(), VK_IMAGE_LAYOUT_GENERAL};
        write.descriptorType = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
        write.pImageInfo = &images[i];
        break;
    }
  }
  vkUpdateDescriptorSets(device, uint32_t(bindings.size()), writes.data(), 0, nullptr);
}

}  // namespace

Recorder::Recorder(std::shared_ptr<Context> context, uint32_t max_dispatches)
    : context_(std::move(context)),
      max_dispatches_(max_dispatches),
      dispatches_left_(max_dispatches) {
  const VkDevice device = context_->device();
  VkCommandPoolCreateInfo pool{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
  pool.queueFamilyIndex = context_->queue_family();
  check(vkCreateCommandPool(device, &pool, nullptr, &pool_), "creating a command pool");
  VkCommandBufferAllocateInfo allocate{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
  allocate.commandPool = pool_;
  allocate.commandBufferCount = 1;
  check(vkAllocateCommandBuffers(device, &allocate, &commands_), "creating a command list");
  const uint32_t each = max_dispatches * kMaxBindingsPerDispatch;
  const VkDescriptorPoolSize sizes[] = {{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, each},
                                        {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, each},
                                        {VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, each},
                                        {VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, each},
                                        {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, each}};
  VkDescriptorPoolCreateInfo descriptors{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
  descriptors.maxSets = max_dispatches;
  descriptors.poolSizeCount = uint32_t(std::size(sizes));
  descriptors.pPoolSizes = sizes;
  check(vkCreateDescriptorPool(device, &descriptors, nullptr, &descriptors_),
        "creating descriptors");
  const VkFenceCreateInfo fence{VK_STRUCTURE_TYPE_FENCE_CREATE_INFO};
  check(vkCreateFence(device, &fence, nullptr, &fence_), "creating a fence");
  VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
  check(vkBeginCommandBuffer(commands_, &begin), "recording");
}

Recorder::~Recorder() {
  const VkDevice device = context_->device();
  drain();
  vkDestroyQueryPool(device, queries_, nullptr);
  vkDestroyFence(device, fence_, nullptr);
  vkDestroyDescriptorPool(device, descriptors_, nullptr);
  vkDestroyCommandPool(device, pool_, nullptr);
}

void Recorder::restart() {
  wait();
  const VkDevice device = context_->device();
  check(vkResetDescriptorPool(device, descriptors_, 0), "freeing descriptors");
  check(vkResetCommandPool(device, pool_, 0), "forgetting a command list");
  dispatches_left_ = max_dispatches_;
  stamp_names_.clear();
  recording_ = true;
  concurrent_ = false;
  transferred_ = true;
  const VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
  check(vkBeginCommandBuffer(commands_, &begin), "recording");
  if (queries_) vkCmdResetQueryPool(commands_, queries_, 0, kMaxStamps);
}

// A barrier between dispatches names only them: on a GPU one that also names copies and indirect
// commands takes half of the time of a short step (docs/benchmarks/gpu.md).
void Recorder::barrier(Next next) {
  if (concurrent_ && waited_ == next) return;
  waited_ = next;
  VkMemoryBarrier all{VK_STRUCTURE_TYPE_MEMORY_BARRIER};
  all.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
  all.dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT;
  VkPipelineStageFlags before = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT;
  VkPipelineStageFlags after = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT;
  if (transferred_ || next != Next::kDispatch) {
    all.srcAccessMask |= VK_ACCESS_TRANSFER_WRITE_BIT;
    all.dstAccessMask |= VK_ACCESS_TRANSFER_READ_BIT | VK_ACCESS_TRANSFER_WRITE_BIT |
                         VK_ACCESS_INDIRECT_COMMAND_READ_BIT;
    before |= VK_PIPELINE_STAGE_TRANSFER_BIT;
    after |= VK_PIPELINE_STAGE_TRANSFER_BIT | VK_PIPELINE_STAGE_DRAW_INDIRECT_BIT;
  }
  transferred_ = next == Next::kTransfer;
  vkCmdPipelineBarrier(commands_, before, after, 0, 1, &all, 0, nullptr, 0, nullptr);
}

void Recorder::begin_concurrent() {
  concurrent_ = true;
  waited_.reset();
}

void Recorder::end_concurrent() {
  concurrent_ = false;
}

void Recorder::prepare(const Image& image) {
  VkImageMemoryBarrier fresh{VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER};
  fresh.dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT |
                        VK_ACCESS_TRANSFER_READ_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;
  fresh.oldLayout = VK_IMAGE_LAYOUT_UNDEFINED;
  fresh.newLayout = VK_IMAGE_LAYOUT_GENERAL;
  fresh.srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  fresh.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  fresh.image = image.handle();
  fresh.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  const VkPipelineStageFlags stages =
      VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
  vkCmdPipelineBarrier(commands_, stages, stages, 0, 0, nullptr, 0, nullptr, 1, &fresh);
}

void Recorder::bind(const Kernel& kernel, const std::vector<Binding>& bindings, const void* push,
                    Next next) {
  assert(recording_ && "recording ended with the first run()");
  assert(bindings.size() == kernel.bindings().size() && bindings.size() <= kMaxBindingsPerDispatch);
  if (dispatches_left_-- == 0)
    throw Failure(VK_ERROR_OUT_OF_POOL_MEMORY, "recording more dispatches than announced");
  barrier(next);
  VkDescriptorSetAllocateInfo allocate{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
  const VkDescriptorSetLayout layout = kernel.set_layout();
  allocate.descriptorPool = descriptors_;
  allocate.descriptorSetCount = 1;
  allocate.pSetLayouts = &layout;
  VkDescriptorSet set = VK_NULL_HANDLE;
  check(vkAllocateDescriptorSets(context_->device(), &allocate, &set), "binding a kernel's data");

  write_set(context_->device(), set, kernel, bindings);
  vkCmdBindPipeline(commands_, VK_PIPELINE_BIND_POINT_COMPUTE, kernel.pipeline());
  vkCmdBindDescriptorSets(commands_, VK_PIPELINE_BIND_POINT_COMPUTE, kernel.layout(), 0, 1, &set, 0,
                          nullptr);
  if (kernel.push_bytes()) {
    vkCmdPushConstants(commands_, kernel.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0,
                       kernel.push_bytes(), push);
  }
}

void Recorder::dispatch(const Kernel& kernel, const std::vector<Binding>& bindings,
                        const void* push, glm::ivec3 groups) {
  bind(kernel, bindings, push, Next::kDispatch);
  vkCmdDispatch(commands_, uint32_t(groups.x), uint32_t(groups.y), uint32_t(groups.z));
}

void Recorder::dispatch_indirect(const Kernel& kernel, const std::vector<Binding>& bindings,
                                 const void* push, const Buffer& groups, uint64_t first_word) {
  bind(kernel, bindings, push, Next::kIndirectDispatch);
  vkCmdDispatchIndirect(commands_, groups.handle(), 4 * first_word);
}

void Recorder::copy(const Buffer& from, const Image& to) {
  barrier(Next::kTransfer);
  VkBufferImageCopy region{};
  region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  region.imageExtent = {uint32_t(to.size().x), uint32_t(to.size().y), uint32_t(to.size().z)};
  vkCmdCopyBufferToImage(commands_, from.handle(), to.handle(), VK_IMAGE_LAYOUT_GENERAL, 1,
                         &region);
}

void Recorder::copy(const Image& from, const Buffer& to) {
  barrier(Next::kTransfer);
  VkBufferImageCopy region{};
  region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  region.imageExtent = {uint32_t(from.size().x), uint32_t(from.size().y), uint32_t(from.size().z)};
  vkCmdCopyImageToBuffer(commands_, from.handle(), VK_IMAGE_LAYOUT_GENERAL, to.handle(), 1,
                         &region);
}

void Recorder::copy_slices(const Image& from, int first, int slices, const Buffer& to) {
  barrier(Next::kTransfer);
  VkBufferImageCopy region{};
  region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  region.imageOffset = {0, 0, first};
  region.imageExtent = {uint32_t(from.size().x), uint32_t(from.size().y), uint32_t(slices)};
  vkCmdCopyImageToBuffer(commands_, from.handle(), VK_IMAGE_LAYOUT_GENERAL, to.handle(), 1,
                         &region);
}

void Recorder::copy(const Buffer& from, const Buffer& to, uint64_t bytes) {
  barrier(Next::kTransfer);
  const VkBufferCopy region{0, 0, bytes};
  vkCmdCopyBuffer(commands_, from.handle(), to.handle(), 1, &region);
}

void Recorder::fill(const Buffer& buffer, uint32_t word, uint64_t bytes) {
  barrier(Next::kTransfer);
  vkCmdFillBuffer(commands_, buffer.handle(), 0, bytes, word);
}

void Recorder::clear(const Image& image, glm::vec4 value) {
  barrier(Next::kTransfer);
  const VkClearColorValue color{{value.x, value.y, value.z, value.w}};
  const VkImageSubresourceRange all{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  vkCmdClearColorImage(commands_, image.handle(), VK_IMAGE_LAYOUT_GENERAL, &color, 1, &all);
}

void Recorder::stamp(const std::string& name) {
  if (!queries_) {
    VkQueryPoolCreateInfo create{VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO};
    create.queryType = VK_QUERY_TYPE_TIMESTAMP;
    create.queryCount = kMaxStamps;
    check(vkCreateQueryPool(context_->device(), &create, nullptr, &queries_),
          "creating time stamps");
    vkCmdResetQueryPool(commands_, queries_, 0, kMaxStamps);
  }
  if (stamp_names_.size() == kMaxStamps) return;
  vkCmdWriteTimestamp(commands_, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, queries_,
                      uint32_t(stamp_names_.size()));
  stamp_names_.push_back(name);
}

void Recorder::finish() {
  if (!recording_) return;
  // Makes device writes available to the host: it reads host-visible buffers after the fence.
  VkMemoryBarrier host{VK_STRUCTURE_TYPE_MEMORY_BARRIER};
  host.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;
  host.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
  vkCmdPipelineBarrier(commands_,
                       VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT,
                       VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &host, 0, nullptr, 0, nullptr);
  check(vkEndCommandBuffer(commands_), "recording");
  recording_ = false;
}

void Recorder::start() {
  finish();
  assert(!pending_ && "wait() before the next start()");
  check(vkResetFences(context_->device(), 1, &fence_), "resetting a fence");
  context_->submit(commands_, fence_);
  pending_ = true;
}

void Recorder::wait() {
  if (!pending_) return;
  check(vkWaitForFences(context_->device(), 1, &fence_, VK_TRUE, UINT64_MAX),
        "waiting for the device");
  pending_ = false;
}

void Recorder::drain() noexcept {
  if (pending_) vkWaitForFences(context_->device(), 1, &fence_, VK_TRUE, UINT64_MAX);
  pending_ = false;
}

void Recorder::run() {
  start();
  wait();
}

std::vector<Recorder::TimerStamp> Recorder::timestamps() {
  std::vector<TimerStamp> stamps;
  if (stamp_names_.empty()) return stamps;
  std::vector<uint64_t> ticks(stamp_names_.size());
  check(vkGetQueryPoolResults(context_->device(), queries_, 0, uint32_t(ticks.size()),
                              ticks.size() * 8, ticks.data(), 8,
                              VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
        "reading time stamps");
  for (size_t i = 0; i < ticks.size(); ++i) {
    stamps.push_back({stamp_names_[i], double(ticks[i] - ticks[0]) *
                                           double(context_->limits().timestampPeriod) * 1e-9});
  }
  return stamps;
}

}  // namespace palpate::vulkan
