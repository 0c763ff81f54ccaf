#include "module/xr/frame_commands.h"

#include "compute/vulkan/tried.h"

namespace palpate::xr {
namespace {

using vulkan::check;

struct Access {
  VkImageLayout layout;
  VkPipelineStageFlags stages;
  VkAccessFlags access;
};
constexpr Access kTransfer{VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_PIPELINE_STAGE_TRANSFER_BIT,
                           VK_ACCESS_TRANSFER_WRITE_BIT};

/// How XR_KHR_vulkan_enable2 hands images over, both ways. All stages: the queue need not know
/// graphics ones.
Access with_runtime(bool depth) {
  return {depth ? VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL
                : VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL,
          VK_PIPELINE_STAGE_ALL_COMMANDS_BIT,
          VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT};
}

void hand_over(VkCommandBuffer commands, VkImage image, bool depth, const Access& from,
               const Access& to) {
  VkImageMemoryBarrier barrier{VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER};
  barrier.srcAccessMask = from.access;
  barrier.dstAccessMask = to.access;
  barrier.oldLayout = from.layout;
  barrier.newLayout = to.layout;
  barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.image = image;
  barrier.subresourceRange = {
      VkImageAspectFlags(depth ? VK_IMAGE_ASPECT_DEPTH_BIT : VK_IMAGE_ASPECT_COLOR_BIT), 0,
      VK_REMAINING_MIP_LEVELS, 0, VK_REMAINING_ARRAY_LAYERS};
  vkCmdPipelineBarrier(commands, from.stages, to.stages, 0, 0, nullptr, 0, nullptr, 1, &barrier);
}

}  // namespace

Result<std::unique_ptr<FrameCommands>> FrameCommands::make(
    std::shared_ptr<vulkan::Context> context) {
  return vulkan::tried(
      [&] { return std::unique_ptr<FrameCommands>(new FrameCommands(std::move(context))); });
}

FrameCommands::FrameCommands(std::shared_ptr<vulkan::Context> context)
    : context_(std::move(context)) {
  VkCommandPoolCreateInfo pool{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
  pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
  pool.queueFamilyIndex = context_->queue_family();
  check(vkCreateCommandPool(context_->device(), &pool, nullptr, &pool_), "making a command pool");
  VkCommandBufferAllocateInfo allocate{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
  allocate.commandPool = pool_;
  allocate.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  allocate.commandBufferCount = 1;
  VkFenceCreateInfo fence{VK_STRUCTURE_TYPE_FENCE_CREATE_INFO};
  const VkResult allocated = vkAllocateCommandBuffers(context_->device(), &allocate, &commands_);
  const VkResult fenced = allocated == VK_SUCCESS
                              ? vkCreateFence(context_->device(), &fence, nullptr, &fence_)
                              : allocated;
  if (fenced != VK_SUCCESS) {
    vkDestroyCommandPool(context_->device(), pool_, nullptr);
    check(fenced, "making a command buffer and its fence");
  }
}

FrameCommands::~FrameCommands() {
  // A lost device has no work to wait for: whatever the result is, the objects may be destroyed.
  if (pending_) vkWaitForFences(context_->device(), 1, &fence_, VK_TRUE, UINT64_MAX);
  vkDestroyFence(context_->device(), fence_, nullptr);
  vkDestroyCommandPool(context_->device(), pool_, nullptr);
}

void FrameCommands::finish() {
  if (!pending_) return;
  pending_ = false;
  check(vkWaitForFences(context_->device(), 1, &fence_, VK_TRUE, UINT64_MAX),
        "waiting for the frame before");
  check(vkResetFences(context_->device(), 1, &fence_), "resetting a fence");
}

Result<Drawn> FrameCommands::run(const Target& color, const Target& depth,
                                 const std::function<Result<Drawn>(VkCommandBuffer)>& draw) {
  return vulkan::tried([&]() -> Result<Drawn> {
    finish();
    VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    check(vkBeginCommandBuffer(commands_, &begin), "beginning a frame");
    const auto hand = [&](const Target& target, bool is_depth, bool to_source) {
      if (!target.image) return;
      Access runtime = with_runtime(is_depth);
      if (to_source) {
        // The image's content does not matter, only that it is no longer in use.
        runtime.layout = VK_IMAGE_LAYOUT_UNDEFINED;
        hand_over(commands_, target.image, is_depth, runtime, kTransfer);
      } else {
        hand_over(commands_, target.image, is_depth, kTransfer, runtime);
      }
    };
    hand(color, false, true);
    hand(depth, true, true);
    const Result<Drawn> drawn = draw(commands_);
    if (!drawn) return drawn;
    hand(color, false, false);
    hand(depth, true, false);
    check(vkEndCommandBuffer(commands_), "ending a frame");
    context_->submit(commands_, fence_);
    pending_ = true;
    return drawn;
  });
}

}  // namespace palpate::xr
