// Reference and action spaces.
#include <algorithm>

#include "tests/xr/runtime/world.h"

namespace palpate::test::fake {
namespace {

XrSession session_of(XrSpace handle) {
  const std::lock_guard lock(world().mutex);
  const auto* space = world().find<Space>(Kind::kSpace, id_of(handle));
  return space ? handle_of<XrSession>(space->parent) : XR_NULL_HANDLE;
}

/// room_from_space; none while its controller, or bare hand, is not there. flags: what is known of
/// it.
std::optional<XrPosef> place(const Space& space, XrTime time, XrSpaceLocationFlags& flags) {
  World& w = world();
  if (space.reference) {
    if (!w.setup().tracked && space.type == XR_REFERENCE_SPACE_TYPE_VIEW) return std::nullopt;
    if (space.type == XR_REFERENCE_SPACE_TYPE_COMBINED_EYE_VARJO && !w.setup().gaze_seen)
      return std::nullopt;
    return compose(w.room_from(space.type, time), space.offset);
  }
  if (space.hand < 0) return std::nullopt;
  const auto* session = w.find<Session>(Kind::kSession, space.parent);
  if (!session->synced || session->state != XR_SESSION_STATE_FOCUSED) return std::nullopt;
  if (space.is_model)
    return w.hands[space.hand] ? std::optional(w.hands[space.hand](time)) : std::nullopt;
  const char* side = space.hand == 0 ? "/user/hand/left" : "/user/hand/right";
  const auto parts =
      bound_parts(*w.find<Action>(Kind::kAction, space.action), w.path_numbers.at(side));
  if (parts.empty()) return std::nullopt;
  if (w.hands[space.hand]) return compose(w.hands[space.hand](time), space.offset);
  // Of a bare hand there is the fingertip only.
  const auto seen = w.fingers[space.hand](time);
  if (!seen || parts[0].find("/poke_ext/pose") == std::string::npos) return std::nullopt;
  flags = seen->flags;
  return compose({{0, 0, 0, 1}, seen->index_tip}, space.offset);
}

}  // namespace

XrResult xr_EnumerateReferenceSpaces(XrSession handle, uint32_t capacity, uint32_t* count,
                                     XrReferenceSpaceType* spaces) {
  const Call call("xrEnumerateReferenceSpaces", handle);
  if (call.answered()) return call.answer();
  return enumerate(world().spaces(), capacity, count, spaces,
                   [](auto from, auto& to) { to = from; });
}

XrResult xr_CreateReferenceSpace(XrSession handle, const XrReferenceSpaceCreateInfo* create,
                                 XrSpace* made) {
  const Call call("xrCreateReferenceSpace", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  const std::vector<XrReferenceSpaceType> offered = w.spaces();
  if (std::find(offered.begin(), offered.end(), create->referenceSpaceType) == offered.end())
    return w.violation("xrCreateReferenceSpace", XR_ERROR_REFERENCE_SPACE_UNSUPPORTED);
  if (!unit(create->poseInReferenceSpace.orientation))
    return w.violation("xrCreateReferenceSpace: pose", XR_ERROR_POSE_INVALID);
  Space& space = w.add<Space>(Kind::kSpace, call.session->id);
  space.reference = true;
  space.type = create->referenceSpaceType;
  space.offset = create->poseInReferenceSpace;
  *made = handle_of<XrSpace>(space.id);
  return XR_SUCCESS;
}

XrResult xr_GetReferenceSpaceBoundsRect(XrSession handle, XrReferenceSpaceType,
                                        XrExtent2Df* bounds) {
  const Call call("xrGetReferenceSpaceBoundsRect", handle);
  if (call.answered()) return call.answer();
  *bounds = {0, 0};
  return XR_SPACE_BOUNDS_UNAVAILABLE;
}

XrResult xr_CreateActionSpace(XrSession handle, const XrActionSpaceCreateInfo* create,
                              XrSpace* made) {
  const Call call("xrCreateActionSpace", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  const auto* action = w.find<Action>(Kind::kAction, id_of(create->action));
  if (!action || action->type != XR_ACTION_TYPE_POSE_INPUT)
    return w.violation("xrCreateActionSpace: action", XR_ERROR_ACTION_TYPE_MISMATCH);
  if (!unit(create->poseInActionSpace.orientation))
    return w.violation("xrCreateActionSpace: pose", XR_ERROR_POSE_INVALID);
  Space& space = w.add<Space>(Kind::kSpace, call.session->id);
  space.action = action->id;
  space.offset = create->poseInActionSpace;
  if (create->subactionPath) {
    const auto& hands = action->hands;
    if (std::find(hands.begin(), hands.end(), create->subactionPath) == hands.end())
      return w.violation("xrCreateActionSpace: subaction", XR_ERROR_PATH_UNSUPPORTED);
    space.hand = w.paths[create->subactionPath - 1] == "/user/hand/left" ? 0 : 1;
  }
  *made = handle_of<XrSpace>(space.id);
  return XR_SUCCESS;
}

XrResult xr_DestroySpace(XrSpace handle) {
  const Call call("xrDestroySpace", session_of(handle));
  if (!call.session) return call.answer();
  world().remove(id_of(handle));
  return XR_SUCCESS;
}

XrResult xr_LocateSpace(XrSpace handle, XrSpace base_handle, XrTime time,
                        XrSpaceLocation* location) {
  const Call call("xrLocateSpace", session_of(handle));
  if (call.answered()) return call.answer();
  World& w = world();
  const auto* space = w.find<Space>(Kind::kSpace, id_of(handle));
  const auto* base = w.find<Space>(Kind::kSpace, id_of(base_handle));
  if (!base) return w.violation("xrLocateSpace: base", XR_ERROR_HANDLE_INVALID);
  if (time <= 0) return w.violation("xrLocateSpace: time", XR_ERROR_TIME_INVALID);
  if (location->type != XR_TYPE_SPACE_LOCATION) return w.violation("xrLocateSpace: type");
  XrSpaceLocationFlags flags = 0xF;
  const auto a = place(*base, time, flags), b = place(*space, time, flags);
  location->locationFlags = a && b ? flags : 0;
  if (a && b) location->pose = compose(inverted(*a), *b);
  auto* velocity = static_cast<XrSpaceVelocity*>(location->next);
  if (!velocity) return XR_SUCCESS;
  if (velocity->type != XR_TYPE_SPACE_VELOCITY) return w.violation("xrLocateSpace: chain");
  velocity->velocityFlags = 0;
  const XrTime step = 1'000'000;
  const auto later = place(*space, time + step, flags);
  if (!a || !b || !later) return XR_SUCCESS;
  const XrVector3f from = compose(inverted(*a), *b).position;
  const XrVector3f to = compose(inverted(*a), *later).position;
  velocity->velocityFlags = XR_SPACE_VELOCITY_LINEAR_VALID_BIT;
  velocity->linearVelocity = {(to.x - from.x) * 1000, (to.y - from.y) * 1000,
                              (to.z - from.z) * 1000};
  return XR_SUCCESS;
}

}  // namespace palpate::test::fake
