#pragma once

#include <optional>
#include <vector>

#include "module/xr/actions.h"
#include "module/xr/clock.h"
#include "module/xr/frame_commands.h"
#include "module/xr/hand_tracking.h"
#include "module/xr/panel_layer.h"
#include "module/xr/render_models.h"
#include "module/xr/spaces.h"
#include "module/xr/swapchains.h"
#include "module/xr/visibility.h"

namespace palpate::xr {

/// The parts of a session that a frame needs.
struct FrameParts {
  const Instance& instance;
  const System& system;
  const OpenXrSession& session;
  const Spaces& spaces;
  Actions& actions;
  HandTracking& tracking;
  RenderModels& models;
  Colocation& colocation;
  PictureSource& source;
  XrEnvironmentBlendMode blend;
  bool see_through;  ///< what the picture does not cover shows what is behind it
};

/// What became of a frame.
struct FrameResult {
  bool drawn = false;  ///< a picture was handed over
  bool depth = false;
  int64_t period_ns = 0;
  Hands hands;
};

/// Ninth and last in the life cycle: wait, begin, locate, draw, end. Swapchains are made by the
/// first frame that is displayed, because a session may run for long without one.
class FrameLoop {
 public:
  FrameLoop(std::shared_ptr<vulkan::Context> context, double view_scale)
      : context_(std::move(context)), view_scale_(view_scale) {}

  /// One whole frame: blocks in xrWaitFrame. Whatever fails between xrBeginFrame and xrEndFrame,
  /// the frame is ended, without a picture, before the problem is returned.
  Outcome<FrameResult> run(const FrameParts& parts);

  /// Why there is no panel where one was to be shown; `call` is empty if nothing failed.
  const Problem& no_panel() const { return no_panel_; }

  /// The mask of this view changed: it is asked for again.
  void forget_mask(uint32_t view) {
    if (view < masks_.size()) masks_[view].reset();
  }

 private:
  struct Layer;
  Done prepare(const FrameParts& parts);
  Done locate_eyes(const FrameParts& parts, XrTime time, Layer& layer, HeadsetFrame& frame,
                   bool& valid);
  Outcome<Drawn> draw(const FrameParts& parts, HeadsetFrame& frame);
  Done show_panel(const FrameParts& parts, Layer& layer);
  Done fill(const FrameParts& parts, const XrFrameState& state, Layer& layer, Hands& hands);
  Done end(const FrameParts& parts, XrTime time, const Layer& layer);

  std::shared_ptr<vulkan::Context> context_;
  double view_scale_;
  std::optional<Swapchains> chains_;
  std::unique_ptr<FrameCommands> commands_;       ///< goes first: its work uses the images
  std::unique_ptr<PanelLayer> panel_;             ///< made for the first panel
  std::vector<std::optional<HiddenMesh>> masks_;  ///< of each view, as far as they are known
  Problem no_panel_;
};

}  // namespace palpate::xr
