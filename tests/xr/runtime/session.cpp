// Sessions, their states, frames and views.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "tests/xr/runtime/world.h"

namespace palpate::test::fake {
namespace {

XrSpace nothing() {
  return XR_NULL_HANDLE;
}

uint32_t view_count(XrViewConfigurationType views) {
  return views == XR_VIEW_CONFIGURATION_TYPE_PRIMARY_QUAD_VARJO ? 4 : 2;
}

/// The error in the part of a swapchain that a layer shows; empty if there is none.
std::string check_part(Session& session, const XrSwapchainSubImage& part, bool depth) {
  World& w = world();
  const auto* chain = w.find<Swapchain>(Kind::kSwapchain, id_of(part.swapchain));
  if (!chain || chain->parent != session.id) return "no such swapchain";
  if (chain->last_released < 0) return "nothing was released yet";
  if (!chain->acquired.empty()) return "image not released";
  const XrRect2Di& rect = part.imageRect;
  if (rect.offset.x < 0 || rect.offset.y < 0 || rect.extent.width <= 0 || rect.extent.height <= 0 ||
      uint32_t(rect.offset.x + rect.extent.width) > chain->info.width ||
      uint32_t(rect.offset.y + rect.extent.height) > chain->info.height)
    return "rectangle outside the image";
  if (part.imageArrayIndex >= chain->info.arraySize) return "no such layer";
  const bool is_depth =
      (chain->info.usageFlags & XR_SWAPCHAIN_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT) != 0;
  return is_depth == depth ? "" : "colour and depth swapped";
}

/// The error in a view of a projection layer; empty if there is none.
std::string check_view(Session& session, const XrCompositionLayerProjectionView& view, bool depth,
                       const XrSwapchainSubImage& part) {
  if (!unit(view.pose.orientation)) return "orientation not of unit length";
  if (!(view.fov.angleLeft < view.fov.angleRight && view.fov.angleDown < view.fov.angleUp))
    return "field of view upside down";
  return check_part(session, part, depth);
}

void keep_colours(Session& session, const XrSwapchainSubImage& part, Picture& picture) {
  World& w = world();
  const auto* chain = w.find<Swapchain>(Kind::kSwapchain, id_of(part.swapchain));
  picture.width = uint32_t(part.imageRect.extent.width);
  picture.height = uint32_t(part.imageRect.extent.height);
  if (!read_back(session, *chain, part.imageArrayIndex, part.imageRect, picture.rgba))
    w.violation("xrEndFrame: the picture can not be read back");
  picture.format = VkFormat(chain->info.format);
  picture.light = light_of(picture.format, picture.rgba);
}

void keep_picture(Session& session, const XrCompositionLayerProjectionView& view,
                  const XrCompositionLayerDepthInfoKHR* depth, Picture& picture) {
  keep_colours(session, view.subImage, picture);
  if (!depth) return;
  World& w = world();
  const auto* depths = w.find<Swapchain>(Kind::kSwapchain, id_of(depth->subImage.swapchain));
  std::vector<uint32_t> words;
  if (!read_back(session, *depths, depth->subImage.imageArrayIndex, depth->subImage.imageRect,
                 words))
    w.violation("xrEndFrame: the depth can not be read back");
  picture.depth.resize(words.size());
  std::memcpy(picture.depth.data(), words.data(), words.size() * sizeof(float));
  picture.near_m = depth->nearZ;
  picture.far_m = depth->farZ;
}

XrResult take_layer(Session& session, const XrCompositionLayerProjection& layer) {
  World& w = world();
  const auto* space = w.find<Space>(Kind::kSpace, id_of(layer.space));
  if (!space || space->parent != session.id)
    return w.violation("xrEndFrame: space", XR_ERROR_HANDLE_INVALID);
  if (layer.viewCount != view_count(session.views))
    return w.violation("xrEndFrame: views", XR_ERROR_LAYER_INVALID);
  w.ended.flags = layer.layerFlags;
  w.ended.space = space->type;
  std::vector<Picture> pictures(layer.viewCount);
  for (uint32_t i = 0; i < layer.viewCount; ++i) {
    const XrCompositionLayerProjectionView& view = layer.views[i];
    if (view.type != XR_TYPE_COMPOSITION_LAYER_PROJECTION_VIEW)
      return w.violation("xrEndFrame: view type");
    std::string bad = check_view(session, view, false, view.subImage);
    const auto* depth = static_cast<const XrCompositionLayerDepthInfoKHR*>(view.next);
    if (bad.empty() && depth) {
      if (depth->type != XR_TYPE_COMPOSITION_LAYER_DEPTH_INFO_KHR)
        return w.violation("xrEndFrame: unknown chain");
      bad = check_view(session, view, true, depth->subImage);
      if (!(depth->minDepth >= 0 && depth->maxDepth <= 1 && depth->minDepth < depth->maxDepth))
        bad = "depth range";
      if (depth->nearZ == depth->farZ || std::isnan(depth->nearZ) || std::isnan(depth->farZ))
        bad = "depth planes";
      w.ended.depth = true;
    }
    if (!bad.empty()) return w.violation("xrEndFrame: " + bad, XR_ERROR_LAYER_INVALID);
    w.ended.eyes[i] = view.pose;
    if (w.setup().keep_pictures) keep_picture(session, view, depth, pictures[i]);
  }
  w.shown = std::move(pictures);
  return XR_SUCCESS;
}

XrResult take_quad(Session& session, const XrCompositionLayerQuad& layer) {
  World& w = world();
  const auto* space = w.find<Space>(Kind::kSpace, id_of(layer.space));
  if (!space || space->parent != session.id)
    return w.violation("xrEndFrame: space of a quad", XR_ERROR_HANDLE_INVALID);
  if (!unit(layer.pose.orientation)) return w.violation("xrEndFrame: pose of a quad");
  if (!(layer.size.width > 0 && layer.size.height > 0))
    return w.violation("xrEndFrame: size of a quad");
  const std::string bad = check_part(session, layer.subImage, false);
  if (!bad.empty()) return w.violation("xrEndFrame: quad: " + bad, XR_ERROR_LAYER_INVALID);
  Quad quad{{}, layer.pose, layer.size, space->type};
  if (w.setup().keep_pictures) keep_colours(session, layer.subImage, quad.picture);
  w.hanging.push_back(std::move(quad));
  return XR_SUCCESS;
}

}  // namespace

// NOLINTBEGIN(readability-identifier-naming): OpenXR's names

XrResult xr_CreateSession(XrInstance handle, const XrSessionCreateInfo* create, XrSession* made) {
  const Call call("xrCreateSession", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  const auto* next = static_cast<const XrBaseInStructure*>(create->next);
  const XrSessionCreateInfoOverlayEXTX* overlay = nullptr;
  if (next && next->type == XR_TYPE_SESSION_CREATE_INFO_OVERLAY_EXTX) {
    if (call.instance->extensions.count(XR_EXTX_OVERLAY_EXTENSION_NAME) == 0)
      return w.violation("xrCreateSession: an overlay without the extension");
    overlay = reinterpret_cast<const XrSessionCreateInfoOverlayEXTX*>(next);
    if (overlay->createFlags != 0) return w.violation("xrCreateSession: flags of an overlay");
    next = static_cast<const XrBaseInStructure*>(overlay->next);
  }
  const auto* binding = reinterpret_cast<const XrGraphicsBindingVulkanKHR*>(next);
  if (!binding || binding->type != XR_TYPE_GRAPHICS_BINDING_VULKAN_KHR)
    return w.violation("xrCreateSession: no Vulkan", XR_ERROR_GRAPHICS_DEVICE_INVALID);
  if (!call.instance->asked_requirements) {
    return w.violation("xrCreateSession before the requirements",
                       XR_ERROR_GRAPHICS_REQUIREMENTS_CALL_MISSING);
  }
  if (binding->physicalDevice != call.instance->device)
    return w.violation("xrCreateSession: device", XR_ERROR_GRAPHICS_DEVICE_INVALID);
  if (w.setup().own_devices_only && binding->device != call.instance->made)
    return XR_ERROR_GRAPHICS_DEVICE_INVALID;
  for (const auto& [id, object] : w.objects)
    if (object->kind == Kind::kSession)
      return w.violation("xrCreateSession: a second one", XR_ERROR_LIMIT_REACHED);
  Session& session = w.add<Session>(Kind::kSession, call.instance->id);
  session.vk_instance = binding->instance;
  session.physical = binding->physicalDevice;
  session.device = binding->device;
  session.family = binding->queueFamilyIndex;
  if (overlay) session.overlay = int64_t(overlay->sessionLayersPlacement);
  vkGetDeviceQueue(session.device, session.family, binding->queueIndex, &session.queue);
  *made = handle_of<XrSession>(session.id);
  if (w.setup().automatic) {
    w.set_state(session, XR_SESSION_STATE_IDLE);
    w.set_state(session, XR_SESSION_STATE_READY);
  }
  return XR_SUCCESS;
}

XrResult xr_DestroySession(XrSession handle) {
  const Call call("xrDestroySession", handle);
  if (!call.session) return call.answer();
  world().remove(call.session->id);
  return XR_SUCCESS;
}

XrResult xr_BeginSession(XrSession handle, const XrSessionBeginInfo* begin) {
  const Call call("xrBeginSession", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  Session& session = *call.session;
  if (session.running) return w.violation("xrBeginSession: runs", XR_ERROR_SESSION_RUNNING);
  if (session.state != XR_SESSION_STATE_READY)
    return w.violation("xrBeginSession: not ready", XR_ERROR_SESSION_NOT_READY);
  const std::vector<XrViewConfigurationType> offered = w.view_types();
  session.views = begin->primaryViewConfigurationType;
  if (std::find(offered.begin(), offered.end(), session.views) == offered.end())
    return w.violation("xrBeginSession: views", XR_ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED);
  session.running = session.ever_begun = true;
  session.exit_asked = session.begun = false;
  session.waited = 0;
  session.frames_this_run = 0;
  return XR_SUCCESS;
}

XrResult xr_EndSession(XrSession handle) {
  const Call call("xrEndSession", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  Session& session = *call.session;
  if (!session.running)
    return w.violation("xrEndSession: not running", XR_ERROR_SESSION_NOT_RUNNING);
  if (session.state != XR_SESSION_STATE_STOPPING)
    return w.violation("xrEndSession: not stopping", XR_ERROR_SESSION_NOT_STOPPING);
  session.running = false;
  if (w.setup().automatic) {
    w.set_state(session, XR_SESSION_STATE_IDLE);
    if (session.exit_asked) w.set_state(session, XR_SESSION_STATE_EXITING);
  }
  return XR_SUCCESS;
}

static void ask_to_stop(Session& session) {
  World& w = world();
  session.exit_asked = true;
  if (!w.setup().automatic) return;
  // The states on the way down are announced one by one.
  if (session.state == XR_SESSION_STATE_FOCUSED) w.set_state(session, XR_SESSION_STATE_VISIBLE);
  if (session.state == XR_SESSION_STATE_VISIBLE)
    w.set_state(session, XR_SESSION_STATE_SYNCHRONIZED);
  w.set_state(session, XR_SESSION_STATE_STOPPING);
}

void World::exit_by_person() {
  Session* session = newest_session();
  if (session && session->running) ask_to_stop(*session);
}

XrResult xr_RequestExitSession(XrSession handle) {
  const Call call("xrRequestExitSession", handle);
  if (call.answered()) return call.answer();
  if (!call.session->running)
    return world().violation("xrRequestExitSession", XR_ERROR_SESSION_NOT_RUNNING);
  ask_to_stop(*call.session);
  return XR_SUCCESS;
}

XrResult xr_WaitFrame(XrSession handle, const XrFrameWaitInfo*, XrFrameState* state) {
  const Call call("xrWaitFrame", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  Session& session = *call.session;
  if (!session.running)
    return w.violation("xrWaitFrame: not running", XR_ERROR_SESSION_NOT_RUNNING);
  if (state->type != XR_TYPE_FRAME_STATE) return w.violation("xrWaitFrame: type");
  if (session.waited > 0) return w.violation("xrWaitFrame twice", XR_ERROR_CALL_ORDER_INVALID);
  // The virtual clock: a frame takes one period, whatever time really passed.
  w.next_frame();
  ++session.waited;
  session.waited_time = w.time + w.period();
  state->predictedDisplayTime = session.waited_time;
  state->predictedDisplayPeriod = w.period();
  state->shouldRender = w.setup().should_render && (session.state == XR_SESSION_STATE_VISIBLE ||
                                                    session.state == XR_SESSION_STATE_FOCUSED);
  return XR_SUCCESS;
}

XrResult xr_BeginFrame(XrSession handle, const XrFrameBeginInfo*) {
  const Call call("xrBeginFrame", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  Session& session = *call.session;
  if (!session.running)
    return w.violation("xrBeginFrame: not running", XR_ERROR_SESSION_NOT_RUNNING);
  if (session.waited == 0)
    return w.violation("xrBeginFrame without xrWaitFrame", XR_ERROR_CALL_ORDER_INVALID);
  --session.waited;
  const bool discarded = session.begun;
  session.begun = true;
  session.open_time = session.waited_time;
  if (discarded) w.violation("xrBeginFrame: the frame before was not ended");
  return discarded ? XR_FRAME_DISCARDED : XR_SUCCESS;
}

XrResult xr_EndFrame(XrSession handle, const XrFrameEndInfo* end) {
  const Call call("xrEndFrame", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  Session& session = *call.session;
  if (!session.running) return w.violation("xrEndFrame: not running", XR_ERROR_SESSION_NOT_RUNNING);
  if (!session.begun) return w.violation("xrEndFrame without begin", XR_ERROR_CALL_ORDER_INVALID);
  if (end->displayTime != session.open_time)
    return w.violation("xrEndFrame: another time", XR_ERROR_TIME_INVALID);
  const auto& modes = w.setup().blend_modes;
  if (std::find(modes.begin(), modes.end(), end->environmentBlendMode) == modes.end())
    return w.violation("xrEndFrame: blend", XR_ERROR_ENVIRONMENT_BLEND_MODE_UNSUPPORTED);
  session.begun = false;
  w.ended = {};
  w.hanging.clear();
  w.ended.display_time = end->displayTime;
  w.ended.blend = end->environmentBlendMode;
  w.ended.layers = end->layerCount;
  for (uint32_t i = 0; i < end->layerCount; ++i) {
    const XrCompositionLayerBaseHeader* layer = end->layers[i];
    if (!layer || (layer->type != XR_TYPE_COMPOSITION_LAYER_PROJECTION &&
                   layer->type != XR_TYPE_COMPOSITION_LAYER_QUAD))
      return w.violation("xrEndFrame: layer", XR_ERROR_LAYER_INVALID);
    const XrResult taken =
        layer->type == XR_TYPE_COMPOSITION_LAYER_QUAD
            ? take_quad(session, *reinterpret_cast<const XrCompositionLayerQuad*>(layer))
            : take_layer(session, *reinterpret_cast<const XrCompositionLayerProjection*>(layer));
    if (XR_FAILED(taken)) return taken;
  }
  ++w.ended_frames;
  const uint64_t frames = ++session.frames;
  const uint64_t this_run = ++session.frames_this_run;
  if (w.setup().automatic && !session.exit_asked) {
    if (this_run == 1) w.set_state(session, XR_SESSION_STATE_SYNCHRONIZED);
    if (this_run == 2) w.set_state(session, XR_SESSION_STATE_VISIBLE);
    if (this_run == 3) w.set_state(session, XR_SESSION_STATE_FOCUSED);
    if (w.setup().end_after_frames && frames >= w.setup().end_after_frames) ask_to_stop(session);
  }
  return XR_SUCCESS;
}

XrResult xr_EnumerateDisplayRefreshRatesFB(XrSession handle, uint32_t capacity, uint32_t* count,
                                           float* rates) {
  const Call call("xrEnumerateDisplayRefreshRatesFB", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  if (!w.enabled(XR_FB_DISPLAY_REFRESH_RATE_EXTENSION_NAME))
    return w.violation("xrEnumerateDisplayRefreshRatesFB", XR_ERROR_FUNCTION_UNSUPPORTED);
  return enumerate(w.setup().rates_hz, capacity, count, rates,
                   [](auto from, auto& to) { to = from; });
}

XrResult xr_GetDisplayRefreshRateFB(XrSession handle, float* rate) {
  const Call call("xrGetDisplayRefreshRateFB", handle);
  if (call.answered()) return call.answer();
  *rate = float(world().setup().rate_hz);
  return XR_SUCCESS;
}

XrResult xr_RequestDisplayRefreshRateFB(XrSession handle, float rate) {
  const Call call("xrRequestDisplayRefreshRateFB", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  const auto& offered = w.setup().rates_hz;
  if (std::find(offered.begin(), offered.end(), rate) == offered.end())
    return w.violation("xrRequestDisplayRefreshRateFB",
                       XR_ERROR_DISPLAY_REFRESH_RATE_UNSUPPORTED_FB);
  w.change_rate(rate);
  return XR_SUCCESS;
}

XrResult xr_LocateViews(XrSession handle, const XrViewLocateInfo* locate, XrViewState* state,
                        uint32_t capacity, uint32_t* count, XrView* views) {
  const Call call("xrLocateViews", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  const auto* space = w.find<Space>(Kind::kSpace, id_of(locate->space));
  if (!space || locate->space == nothing())
    return w.violation("xrLocateViews: space", XR_ERROR_HANDLE_INVALID);
  if (locate->displayTime <= 0) return w.violation("xrLocateViews", XR_ERROR_TIME_INVALID);
  if (locate->viewConfigurationType != call.session->views)
    return w.violation("xrLocateViews: views", XR_ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED);
  const XrPosef room_from_space =
      compose(w.room_from(space->type, locate->displayTime), space->offset);
  const XrPosef space_from_head = compose(inverted(room_from_space), w.head(locate->displayTime));
  const auto* chained = static_cast<const XrViewLocateFoveatedRenderingVARJO*>(locate->next);
  if (chained &&
      (chained->type != XR_TYPE_VIEW_LOCATE_FOVEATED_RENDERING_VARJO || !w.follows_gaze()))
    return w.violation("xrLocateViews: chain");
  const float gaze = chained && chained->foveatedRenderingActive == XR_TRUE ? w.setup().gaze : 0.0F;
  std::vector<XrView> all(view_count(locate->viewConfigurationType), {XR_TYPE_VIEW});
  for (size_t view = 0; view < all.size(); ++view) {
    const bool right = view % 2 == 1, is_focus = view >= 2;
    XrPosef side = identity();
    side.position.x = right ? 0.0315F : -0.0315F;
    all[view].pose = compose(space_from_head, side);
    const float in = is_focus ? 0.35F : 0.7F, out = is_focus ? 0.25F : 0.9F;
    const float up = is_focus ? 0.2F : 0.8F, down = is_focus ? 0.3F : 0.8F;
    const float aside = is_focus ? gaze : 0.0F;
    all[view].fov = {(right ? -in : -out) + aside, (right ? out : in) + aside, up, -down};
  }
  state->viewStateFlags = w.setup().tracked ? 0xF : 0;
  return enumerate(all, capacity, count, views, [](const auto& from, auto& to) { to = from; });
}

XrResult xr_GetVisibilityMaskKHR(XrSession handle, XrViewConfigurationType views, uint32_t view,
                                 XrVisibilityMaskTypeKHR type, XrVisibilityMaskKHR* mask) {
  const Call call("xrGetVisibilityMaskKHR", handle);
  if (call.answered()) return call.answer();
  if (view >= view_count(views))
    return world().violation("xrGetVisibilityMaskKHR", XR_ERROR_VALIDATION_FAILURE);
  std::vector<XrVector2f> vertices;
  std::vector<uint32_t> indices;
  if (type == XR_VISIBILITY_MASK_TYPE_HIDDEN_TRIANGLE_MESH_KHR) {
    vertices = world().setup().hidden;
    for (uint32_t i = 0; i < vertices.size(); ++i) indices.push_back(i);
  }
  const auto copy = [](const auto& from, auto& to) { to = from; };
  const XrResult first = enumerate(vertices, mask->vertexCapacityInput, &mask->vertexCountOutput,
                                   mask->vertices, copy);
  const XrResult second =
      enumerate(indices, mask->indexCapacityInput, &mask->indexCountOutput, mask->indices, copy);
  return XR_FAILED(first) ? first : second;
}

// NOLINTEND(readability-identifier-naming)

}  // namespace palpate::test::fake
