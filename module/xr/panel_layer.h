#pragma once

#include <memory>
#include <optional>

#include "compute/vulkan/buffer.h"
#include "module/xr/frame_commands.h"
#include "module/xr/swapchains.h"

namespace palpate::xr {

/// A panel as a layer of the compositor (XrCompositionLayerQuad), which draws it with its full
/// sharpness, whatever the picture's resolution. Its pixels go to the runtime only when they
/// change. Not movable: the device works on it.
class PanelLayer {
 public:
  explicit PanelLayer(std::shared_ptr<vulkan::Context> context) : context_(std::move(context)) {}
  PanelLayer(const PanelLayer&) = delete;
  PanelLayer& operator=(const PanelLayer&) = delete;

  /// The layer without space and pose; none where the compositor still reads its image and there
  /// is no former one.
  Outcome<std::optional<XrCompositionLayerQuad>> show(const OpenXrSession& session,
                                                      const HangingPanel& panel);

 private:
  Done prepare(const OpenXrSession& session, const Picture& pixels);
  Done upload(const Picture& pixels);

  std::shared_ptr<vulkan::Context> context_;
  std::optional<Swapchain> chain_;
  vulkan::Buffer bytes_;
  std::unique_ptr<FrameCommands> commands_;  ///< goes first: its work uses what is above
  std::shared_ptr<const Picture> shown_;     ///< whose pixels the runtime has
};

}  // namespace palpate::xr
