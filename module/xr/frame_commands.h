#pragma once

#include <vulkan/vulkan.h>

#include <functional>
#include <memory>

#include "compute/vulkan/context.h"
#include "module/xr/picture_source.h"

namespace palpate::xr {

/// The command buffer of a frame: one frame is in flight, so that recording waits for the frame
/// before. Errors: kDeviceFailed, kOutOfMemory. Not movable: the device works on it.
class FrameCommands {
 public:
  static Result<std::unique_ptr<FrameCommands>> make(std::shared_ptr<vulkan::Context> context);
  ~FrameCommands();
  FrameCommands(const FrameCommands&) = delete;
  FrameCommands& operator=(const FrameCommands&) = delete;

  /// Waits for the frame before, records `draw` between the barriers that hand the targets to it in
  /// TRANSFER_DST_OPTIMAL and back to the runtime as attachments, and submits. After an error of
  /// `draw`, which it returns, nothing is submitted.
  Result<Drawn> run(const Target& color, const Target& depth,
                    const std::function<Result<Drawn>(VkCommandBuffer)>& draw);

 private:
  explicit FrameCommands(std::shared_ptr<vulkan::Context> context);
  /// Waits until the device has done the last frame.
  void finish();
  std::shared_ptr<vulkan::Context> context_;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkCommandBuffer commands_ = VK_NULL_HANDLE;
  VkFence fence_ = VK_NULL_HANDLE;
  bool pending_ = false;
};

}  // namespace palpate::xr
