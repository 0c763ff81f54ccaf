#include "module/xr/spaces.h"

#include <algorithm>
#include <vector>

#include "module/xr/newer_openxr.h"

namespace palpate::xr {
namespace {

Outcome<std::vector<XrReferenceSpaceType>> offered_spaces(const OpenXrSession& session) {
  constexpr const char* kCall = "xrEnumerateReferenceSpaces";
  uint32_t count = 0;
  XrResult result = xrEnumerateReferenceSpaces(session.handle(), 0, &count, nullptr);
  if (XR_FAILED(result)) return problem_of(kCall, result);
  std::vector<XrReferenceSpaceType> offered(count);
  result = xrEnumerateReferenceSpaces(session.handle(), count, &count, offered.data());
  if (XR_FAILED(result)) return problem_of(kCall, result);
  offered.resize(count);
  return offered;
}

Done make_space(const OpenXrSession& session, XrReferenceSpaceType type, XrSpace* made) {
  XrReferenceSpaceCreateInfo create{XR_TYPE_REFERENCE_SPACE_CREATE_INFO};
  create.referenceSpaceType = type;
  create.poseInReferenceSpace = identity_pose();
  return done("xrCreateReferenceSpace", xrCreateReferenceSpace(session.handle(), &create, made));
}

XrReferenceSpaceType type_of(Origin origin) {
  switch (origin) {
    case Origin::kStage:
      return XR_REFERENCE_SPACE_TYPE_STAGE;
    case Origin::kView:
      return XR_REFERENCE_SPACE_TYPE_VIEW;
    case Origin::kLocalFloor:
      return kLocalFloorSpace;
    case Origin::kLocal:
      break;
  }
  return XR_REFERENCE_SPACE_TYPE_LOCAL;
}

/// The type of the one of stage and local that follows the person.
XrReferenceSpaceType local_type(Origin origin) {
  return origin == Origin::kLocalFloor ? kLocalFloorSpace : XR_REFERENCE_SPACE_TYPE_LOCAL;
}

}  // namespace

Outcome<Spaces> Spaces::make(const OpenXrSession& session, const System& system, Origin wanted) {
  const auto offered = offered_spaces(session);
  if (!offered) return offered.error();
  const auto has = [&](XrReferenceSpaceType type) {
    return std::find(offered->begin(), offered->end(), type) != offered->end();
  };
  const bool stage = has(XR_REFERENCE_SPACE_TYPE_STAGE);
  Spaces made;
  made.origin_ = wanted;
  if (made.origin_ == Origin::kLocalFloor && !has(kLocalFloorSpace)) made.origin_ = Origin::kStage;
  // Every runtime has LOCAL and VIEW; a seated one has no STAGE.
  if (made.origin_ == Origin::kStage && !stage) made.origin_ = Origin::kLocal;
  Done done = make_space(session, type_of(made.origin_), made.base_.out());
  if (done && stage) {
    done = make_space(session, XR_REFERENCE_SPACE_TYPE_STAGE, made.stage_.out());
    if (done) done = make_space(session, local_type(made.origin_), made.local_.out());
  }
  if (done && !system.gaze_views.empty())
    done = make_space(session, XR_REFERENCE_SPACE_TYPE_COMBINED_EYE_VARJO, made.gaze_.out());
  if (!done) return done.error();
  return made;
}

std::optional<Room> Spaces::room_of(XrReferenceSpaceType type) const {
  if (type == XR_REFERENCE_SPACE_TYPE_STAGE) return Room::kStage;
  if (type == local_type(origin_)) return Room::kLocal;
  return std::nullopt;
}

Outcome<std::optional<Pose>> Spaces::stage_from_local(XrTime time) const {
  if (!stage_) return std::optional<Pose>();
  return locate(local_.get(), stage_.get(), time);
}

Outcome<bool> Spaces::knows_gaze(XrTime time) const {
  if (!gaze_) return false;
  XrSpaceLocation location{XR_TYPE_SPACE_LOCATION};
  const XrResult result = xrLocateSpace(gaze_.get(), base_.get(), time, &location);
  if (XR_FAILED(result)) return problem_of("xrLocateSpace", result);
  return (location.locationFlags & XR_SPACE_LOCATION_ORIENTATION_TRACKED_BIT) != 0;
}

Outcome<std::optional<Pose>> locate(XrSpace space, XrSpace base, XrTime time,
                                    glm::dvec3* velocity_m_per_s, bool tracked) {
  XrSpaceVelocity velocity{XR_TYPE_SPACE_VELOCITY};
  XrSpaceLocation location{XR_TYPE_SPACE_LOCATION};
  if (velocity_m_per_s) location.next = &velocity;
  const XrResult result = xrLocateSpace(space, base, time, &location);
  if (XR_FAILED(result)) return problem_of("xrLocateSpace", result);
  if (velocity_m_per_s && (velocity.velocityFlags & XR_SPACE_VELOCITY_LINEAR_VALID_BIT)) {
    const XrVector3f& v = velocity.linearVelocity;
    *velocity_m_per_s = {v.x, v.y, v.z};
  }
  constexpr XrSpaceLocationFlags kValid =
      XR_SPACE_LOCATION_POSITION_VALID_BIT | XR_SPACE_LOCATION_ORIENTATION_VALID_BIT;
  const XrSpaceLocationFlags wanted =
      kValid | (tracked ? XR_SPACE_LOCATION_POSITION_TRACKED_BIT : 0);
  if ((location.locationFlags & wanted) != wanted) return std::optional<Pose>();
  return std::optional<Pose>(pose_of(location.pose));
}

}  // namespace palpate::xr
