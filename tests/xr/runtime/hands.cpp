// Hands without controllers: XR_EXT_hand_tracking.
#include "tests/xr/runtime/world.h"

namespace palpate::test::fake {
namespace {

XrSession session_of(XrHandTrackerEXT handle) {
  const std::lock_guard lock(world().mutex);
  const auto* tracker = world().find<HandTracker>(Kind::kHandTracker, id_of(handle));
  return tracker ? handle_of<XrSession>(tracker->parent) : XR_NULL_HANDLE;
}

}  // namespace

XrResult xr_CreateHandTrackerEXT(XrSession handle, const XrHandTrackerCreateInfoEXT* create,
                                 XrHandTrackerEXT* made) {
  const Call call("xrCreateHandTrackerEXT", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  if (!call.instance->extensions.count(XR_EXT_HAND_TRACKING_EXTENSION_NAME))
    return w.violation("xrCreateHandTrackerEXT: extension", XR_ERROR_FUNCTION_UNSUPPORTED);
  if (create->type != XR_TYPE_HAND_TRACKER_CREATE_INFO_EXT ||
      create->handJointSet != XR_HAND_JOINT_SET_DEFAULT_EXT ||
      (create->hand != XR_HAND_LEFT_EXT && create->hand != XR_HAND_RIGHT_EXT))
    return w.violation("xrCreateHandTrackerEXT: create info");
  if (!w.setup().sees_hands)
    return w.violation("xrCreateHandTrackerEXT: the system has none", XR_ERROR_FEATURE_UNSUPPORTED);
  HandTracker& tracker = w.add<HandTracker>(Kind::kHandTracker, call.session->id);
  tracker.hand = create->hand == XR_HAND_LEFT_EXT ? 0 : 1;
  *made = handle_of<XrHandTrackerEXT>(tracker.id);
  return XR_SUCCESS;
}

XrResult xr_DestroyHandTrackerEXT(XrHandTrackerEXT handle) {
  const Call call("xrDestroyHandTrackerEXT", session_of(handle));
  if (!call.session) return call.answer();
  world().remove(id_of(handle));
  return XR_SUCCESS;
}

XrResult xr_LocateHandJointsEXT(XrHandTrackerEXT handle, const XrHandJointsLocateInfoEXT* locate,
                                XrHandJointLocationsEXT* locations) {
  const Call call("xrLocateHandJointsEXT", session_of(handle));
  if (call.answered()) return call.answer();
  World& w = world();
  const auto* tracker = w.find<HandTracker>(Kind::kHandTracker, id_of(handle));
  const auto* base = w.find<Space>(Kind::kSpace, id_of(locate->baseSpace));
  if (locate->type != XR_TYPE_HAND_JOINTS_LOCATE_INFO_EXT ||
      locations->type != XR_TYPE_HAND_JOINT_LOCATIONS_EXT)
    return w.violation("xrLocateHandJointsEXT: type");
  if (locations->jointCount != XR_HAND_JOINT_COUNT_EXT || !locations->jointLocations)
    return w.violation("xrLocateHandJointsEXT: joints");
  if (!base || !base->reference)
    return w.violation("xrLocateHandJointsEXT: base", XR_ERROR_HANDLE_INVALID);
  if (locate->time <= 0) return w.violation("xrLocateHandJointsEXT: time", XR_ERROR_TIME_INVALID);
  const FingerScript& script = w.fingers[tracker->hand];
  const auto seen = script ? script(locate->time) : std::nullopt;
  locations->isActive = seen ? XR_TRUE : XR_FALSE;
  const XrPosef base_from_room =
      inverted(compose(w.room_from(base->type, locate->time), base->offset));
  for (uint32_t joint = 0; joint < locations->jointCount; ++joint) {
    XrHandJointLocationEXT& at = locations->jointLocations[joint];
    at = {};
    if (!seen) continue;
    // The other joints only have a pose.
    const bool is_thumb = joint == XR_HAND_JOINT_THUMB_TIP_EXT;
    at.locationFlags = seen->flags;
    at.radius = seen->radius;
    at.pose = compose(base_from_room, {{0, 0, 0, 1}, is_thumb ? seen->thumb_tip : seen->index_tip});
  }
  return XR_SUCCESS;
}

}  // namespace palpate::test::fake
