#include "module/xr/hand_tracking.h"

#include <cmath>
#include <limits>

namespace palpate::xr {
namespace {

constexpr XrSpaceLocationFlags kSeen =
    XR_SPACE_LOCATION_POSITION_VALID_BIT | XR_SPACE_LOCATION_POSITION_TRACKED_BIT;

/// Whether a joint is tracked and not guessed by the runtime: a hand that has left the cameras must
/// not go on touching.
bool is_seen(const XrHandJointLocationEXT& joint) {
  const XrVector3f& p = joint.pose.position;
  return (joint.locationFlags & kSeen) == kSeen && std::isfinite(p.x + p.y + p.z) &&
         std::isfinite(joint.radius);
}

glm::dvec3 place_of(const XrHandJointLocationEXT& joint) {
  return {joint.pose.position.x, joint.pose.position.y, joint.pose.position.z};
}

}  // namespace

Outcome<HandTracking> HandTracking::make(const Instance& instance, const System& system,
                                         const OpenXrSession& session) {
  HandTracking made;
  if (!instance.create_hand_tracker || !system.hand_tracking) return made;
  made.locate_ = instance.locate_hand_joints;
  for (size_t side = 0; side < 2; ++side) {
    XrHandTrackerCreateInfoEXT create{XR_TYPE_HAND_TRACKER_CREATE_INFO_EXT};
    create.hand = side == 0 ? XR_HAND_LEFT_EXT : XR_HAND_RIGHT_EXT;
    create.handJointSet = XR_HAND_JOINT_SET_DEFAULT_EXT;
    ExtensionHandle<XrHandTrackerEXT> tracker(instance.destroy_hand_tracker);
    const Done asked = done("xrCreateHandTrackerEXT",
                            instance.create_hand_tracker(session.handle(), &create, tracker.out()));
    if (!asked) {
      const Done refused = made.refuse(asked.error());
      if (!refused) return refused.error();
      return made;
    }
    made.trackers_[side] = std::move(tracker);
  }
  return made;
}

/// A loss is reported to the session; after any other error hands are left out.
Done HandTracking::refuse(const Problem& problem) {
  if (problem.trouble == Trouble::kSessionLost || problem.trouble == Trouble::kInstanceLost)
    return problem;
  refused_ = call_text(problem);
  trackers_ = {};
  return Nothing{};
}

Done HandTracking::read(XrSpace base, XrTime time, const Pose& world_from_base,
                        std::array<Fingers, 2>& fingers) {
  const std::array<Fingers, 2> given = fingers;
  for (size_t side = 0; side < 2 && works(); ++side) {
    if (given[side].seen) {
      pinches_[side] = {};
      continue;
    }
    std::array<XrHandJointLocationEXT, XR_HAND_JOINT_COUNT_EXT> joints{};
    XrHandJointLocationsEXT locations{XR_TYPE_HAND_JOINT_LOCATIONS_EXT};
    locations.jointCount = uint32_t(joints.size());
    locations.jointLocations = joints.data();
    XrHandJointsLocateInfoEXT locate{XR_TYPE_HAND_JOINTS_LOCATE_INFO_EXT};
    locate.baseSpace = base;
    locate.time = time;
    const Done located =
        done("xrLocateHandJointsEXT", locate_(trackers_[side].get(), &locate, &locations));
    if (!located) {
      fingers = given;
      return refuse(located.error());
    }
    see(locations.isActive ? joints.data() : nullptr, world_from_base, side, fingers[side]);
  }
  return Nothing{};
}

/// joints: null where there is no hand.
void HandTracking::see(const XrHandJointLocationEXT* joints, const Pose& world_from_base,
                       size_t side, Fingers& fingers) {
  fingers = {};
  double gap_m = std::numeric_limits<double>::quiet_NaN();
  if (joints) {
    const XrHandJointLocationEXT& thumb = joints[XR_HAND_JOINT_THUMB_TIP_EXT];
    const XrHandJointLocationEXT& index = joints[XR_HAND_JOINT_INDEX_TIP_EXT];
    fingers.seen = is_seen(thumb) && is_seen(index);
    if (fingers.seen) {
      fingers.fingertip_m = world_from_base(place_of(index));
      gap_m = glm::distance(place_of(thumb), place_of(index)) - thumb.radius - index.radius;
    }
  }
  fingers.pinches = pinches_[side].step(gap_m);
}

}  // namespace palpate::xr
