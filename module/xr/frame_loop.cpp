#include "module/xr/frame_loop.h"

#include <algorithm>

namespace palpate::xr {

/// The layers of one frame; its parts point at each other, so it must not be moved.
struct FrameLoop::Layer {
  std::vector<XrView> views;
  std::vector<XrCompositionLayerProjectionView> projection;
  std::vector<XrCompositionLayerDepthInfoKHR> depth;
  XrCompositionLayerProjection layer{XR_TYPE_COMPOSITION_LAYER_PROJECTION};
  bool shown = false, with_depth = false;
  std::vector<VkExtent2D> size;  ///< pixels that were filled
  std::optional<XrCompositionLayerQuad> panel;
};

namespace {

Fov fov_of(const XrFovf& fov) {
  return {fov.angleLeft, fov.angleRight, fov.angleUp, fov.angleDown};
}

Target target_of(const Swapchain& chain, VkImage image) {
  return {image, chain.format(), chain.size()};
}

}  // namespace

Outcome<FrameResult> FrameLoop::run(const FrameParts& parts) {
  XrFrameState state{XR_TYPE_FRAME_STATE};
  XrFrameWaitInfo wait{XR_TYPE_FRAME_WAIT_INFO};
  Done step = done("xrWaitFrame", xrWaitFrame(parts.session.handle(), &wait, &state));
  if (!step) return step.error();
  {
    const auto queue = context_->hold_queue();
    XrFrameBeginInfo begin{XR_TYPE_FRAME_BEGIN_INFO};
    step = done("xrBeginFrame", xrBeginFrame(parts.session.handle(), &begin));
  }
  if (!step) return step.error();
  Layer layer;
  Hands hands;
  step = fill(parts, state, layer, hands);
  const Done ended = end(parts, state.predictedDisplayTime, layer);
  // The first problem is the cause of what follows it.
  if (!step) return step.error();
  if (!ended) return ended.error();
  return FrameResult{layer.shown, layer.shown && layer.with_depth, state.predictedDisplayPeriod,
                     hands};
}

Done FrameLoop::fill(const FrameParts& parts, const XrFrameState& state, Layer& layer,
                     Hands& hands) {
  const XrTime time = state.predictedDisplayTime;
  const auto time_stamp =
      time_stamp_of(parts.instance, time, state.predictedDisplayPeriod, monotonic_ns());
  if (!time_stamp) return time_stamp.error();
  parts.colocation.advance(time);
  const auto stage_from_local = parts.spaces.stage_from_local(time);
  if (!stage_from_local) return stage_from_local.error();
  if (*stage_from_local) parts.colocation.place_by(**stage_from_local);

  HeadsetFrame frame;
  frame.display_time_ns = time_stamp->ns;
  frame.display_time_exact = time_stamp->exact;
  frame.period_ns = state.predictedDisplayPeriod;
  const Outcome<Hands> read = parts.actions.read(parts.session, parts.spaces.base(), time,
                                                 parts.colocation.world_from_base());
  if (!read) return read.error();
  hands = *read;
  frame.hands = &hands;
  // Like all that hands do: at rest while the input goes elsewhere.
  if (hands.focused) {
    const Done seen = parts.tracking.read(parts.spaces.base(), time,
                                          parts.colocation.world_from_base(), hands.fingers);
    if (!seen) return seen.error();
    auto held = parts.models.read(parts.session, parts.spaces.base(), time,
                                  parts.colocation.world_from_base());
    if (!held) return held.error();
    frame.held = std::move(*held);
  }
  if (!state.shouldRender) return Nothing{};

  Done ready = prepare(parts);
  if (!ready) return ready;
  bool valid = false;
  ready = locate_eyes(parts, time, layer, frame, valid);
  if (!ready || !valid) return ready;
  const Outcome<Drawn> drawn = draw(parts, frame);
  if (!drawn) return drawn.error();
  layer.shown = drawn->color;
  layer.with_depth = drawn->depth && chains_->depth;
  for (size_t eye = 0; eye < std::min(layer.size.size(), drawn->sizes.size()); ++eye) {
    VkExtent2D& size = layer.size[eye];
    size = {std::min(drawn->sizes[eye].width, size.width),
            std::min(drawn->sizes[eye].height, size.height)};
  }
  layer.depth.resize(layer.size.size());
  for (XrCompositionLayerDepthInfoKHR& depth : layer.depth) {
    depth.nearZ = drawn->depth_0_m;
    depth.farZ = drawn->depth_1_m;
  }
  return layer.shown ? show_panel(parts, layer) : Nothing{};
}

/// The picture does not need its panel: one that the runtime refuses is left out for the rest of
/// the session. A loss of the session ends the frame, as everywhere.
Done FrameLoop::show_panel(const FrameParts& parts, Layer& layer) {
  if (*no_panel_.call) return Nothing{};
  const auto wanted = parts.source.panel();
  if (!wanted) return Nothing{};
  if (!panel_) panel_ = std::make_unique<PanelLayer>(context_);
  const auto quad = panel_->show(parts.session, *wanted);
  if (quad) {
    layer.panel = *quad;
    if (!layer.panel) return Nothing{};
    layer.panel->space = parts.spaces.base();
    layer.panel->pose =
        xr_pose_of(inverse(parts.colocation.world_from_base()) * wanted->world_from_panel);
    return Nothing{};
  }
  const Trouble trouble = quad.error().trouble;
  if (trouble == Trouble::kInstanceLost || trouble == Trouble::kSessionLost ||
      trouble == Trouble::kNoGraphics)
    return quad.error();
  no_panel_ = quad.error();
  return Nothing{};
}

Done FrameLoop::prepare(const FrameParts& parts) {
  if (!commands_) {
    auto made = FrameCommands::make(context_);
    if (!made) return of_device(made.error());
    commands_ = std::move(*made);
  }
  if (!chains_) {
    auto made = Swapchains::make(parts.session, parts.system, parts.instance.has_depth_layer(),
                                 view_scale_);
    if (!made) return made.error();
    chains_.emplace(std::move(*made));
  }
  masks_.resize(parts.system.views.size());
  for (uint32_t view = 0; view < masks_.size(); ++view) {
    if (masks_[view]) continue;
    auto mesh = hidden_mesh(parts.instance, parts.session, view);
    if (!mesh) return mesh.error();
    masks_[view] = std::move(*mesh);
  }
  return Nothing{};
}

Done FrameLoop::locate_eyes(const FrameParts& parts, XrTime time, Layer& layer, HeadsetFrame& frame,
                            bool& valid) {
  XrViewLocateInfo locate{XR_TYPE_VIEW_LOCATE_INFO};
  locate.viewConfigurationType = parts.system.view_type;
  locate.displayTime = time;
  locate.space = parts.spaces.base();
  const Outcome<bool> follows_gaze = parts.spaces.knows_gaze(time);
  if (!follows_gaze) return follows_gaze.error();
  XrViewLocateFoveatedRenderingVARJO gaze{XR_TYPE_VIEW_LOCATE_FOVEATED_RENDERING_VARJO};
  gaze.foveatedRenderingActive = *follows_gaze ? XR_TRUE : XR_FALSE;
  if (!parts.system.gaze_views.empty()) locate.next = &gaze;
  XrViewState state{XR_TYPE_VIEW_STATE};
  layer.views.assign(parts.system.views.size(), {XR_TYPE_VIEW});
  uint32_t count = 0;
  const XrResult result = xrLocateViews(parts.session.handle(), &locate, &state,
                                        uint32_t(layer.views.size()), &count, layer.views.data());
  if (XR_FAILED(result)) return problem_of("xrLocateViews", result);
  constexpr XrViewStateFlags kValid =
      XR_VIEW_STATE_POSITION_VALID_BIT | XR_VIEW_STATE_ORIENTATION_VALID_BIT;
  // A picture for a head of unknown place would jump: none is better.
  valid = (state.viewStateFlags & kValid) == kValid;
  const Pose world_from_base = parts.colocation.world_from_base();
  layer.size = *follows_gaze ? chains_->gaze_eyes : chains_->eyes;
  static const HiddenMesh kNothing;
  for (size_t eye = 0; eye < layer.views.size(); ++eye) {
    // A view that follows the gaze has no fixed place behind the optics.
    const bool moves = *follows_gaze && eye >= 2;
    frame.eyes.push_back({world_from_base * pose_of(layer.views[eye].pose),
                          fov_of(layer.views[eye].fov), layer.size[eye],
                          moves ? &kNothing : &*masks_[eye]});
  }
  return Nothing{};
}

Outcome<Drawn> FrameLoop::draw(const FrameParts& parts, HeadsetFrame& frame) {
  Swapchain* depth = chains_->depth ? &*chains_->depth : nullptr;
  const auto color_image = chains_->color.acquire();
  if (!color_image) return color_image.error();
  if (!*color_image) return Drawn{};
  frame.color = target_of(chains_->color, **color_image);
  if (depth) {
    const auto depth_image = depth->acquire();
    if (!depth_image) return depth_image.error();
    if (*depth_image) frame.depth = target_of(*depth, **depth_image);
  }
  Result<Drawn> drawn = commands_->run(frame.color, frame.depth, [&](VkCommandBuffer commands) {
    return parts.source.record(frame, commands);
  });
  // Released in any case: the runtime needs its images back.
  Done released = chains_->color.release();
  if (depth && depth->waited()) {
    const Done depth_released = depth->release();
    if (released) released = depth_released;
  }
  if (!drawn) return of_device(drawn.error());
  if (!released) return released.error();
  drawn->depth = drawn->depth && frame.depth.image;
  return *drawn;
}

Done FrameLoop::end(const FrameParts& parts, XrTime time, const Layer& filled) {
  Layer layer = filled;
  XrFrameEndInfo end{XR_TYPE_FRAME_END_INFO};
  end.displayTime = time;
  end.environmentBlendMode = parts.blend;
  if (layer.shown) layer.projection.resize(layer.views.size());
  for (size_t eye = 0; eye < layer.projection.size(); ++eye) {
    const auto part_of = [&](const Swapchain& chain) {
      const VkExtent2D size = layer.size[eye];
      return XrSwapchainSubImage{
          chain.handle(), {{0, 0}, {int32_t(size.width), int32_t(size.height)}}, uint32_t(eye)};
    };
    XrCompositionLayerProjectionView& view = layer.projection[eye];
    view.type = XR_TYPE_COMPOSITION_LAYER_PROJECTION_VIEW;
    view.pose = layer.views[eye].pose;
    view.fov = layer.views[eye].fov;
    view.subImage = part_of(chains_->color);
    if (!layer.with_depth) continue;
    layer.depth[eye].type = XR_TYPE_COMPOSITION_LAYER_DEPTH_INFO_KHR;
    layer.depth[eye].subImage = part_of(*chains_->depth);
    layer.depth[eye].maxDepth = 1.0F;
    view.next = &layer.depth[eye];
  }
  layer.layer.space = parts.spaces.base();
  layer.layer.viewCount = uint32_t(layer.projection.size());
  layer.layer.views = layer.projection.data();
  if (parts.see_through)
    layer.layer.layerFlags = XR_COMPOSITION_LAYER_BLEND_TEXTURE_SOURCE_ALPHA_BIT;
  // The panel is drawn over the picture.
  std::array<const XrCompositionLayerBaseHeader*, 2> layers{
      reinterpret_cast<const XrCompositionLayerBaseHeader*>(&layer.layer), nullptr};
  if (layer.panel) layers[1] = reinterpret_cast<const XrCompositionLayerBaseHeader*>(&*layer.panel);
  if (layer.shown) {
    end.layerCount = layer.panel ? 2 : 1;
    end.layers = layers.data();
  }
  const auto queue = context_->hold_queue();
  return done("xrEndFrame", xrEndFrame(parts.session.handle(), &end));
}

}  // namespace palpate::xr
