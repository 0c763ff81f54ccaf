#include "module/xr/spaces.h"

#include <algorithm>
#include <vector>

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
  if (origin == Origin::kStage) return XR_REFERENCE_SPACE_TYPE_STAGE;
  return origin == Origin::kLocal ? XR_REFERENCE_SPACE_TYPE_LOCAL : XR_REFERENCE_SPACE_TYPE_VIEW;
}

}  // namespace

Outcome<Spaces> Spaces::make(const OpenXrSession& session, Origin wanted) {
  const auto offered = offered_spaces(session);
  if (!offered) return offered.error();
  const bool stage =
      std::find(offered->begin(), offered->end(), XR_REFERENCE_SPACE_TYPE_STAGE) != offered->end();
  Spaces made;
  // Every runtime has LOCAL and VIEW; a seated one has no STAGE.
  made.origin_ = wanted == Origin::kStage && !stage ? Origin::kLocal : wanted;
  Done done = make_space(session, type_of(made.origin_), made.base_.out());
  if (done && stage) {
    done = make_space(session, XR_REFERENCE_SPACE_TYPE_STAGE, made.stage_.out());
    if (done) done = make_space(session, XR_REFERENCE_SPACE_TYPE_LOCAL, made.local_.out());
  }
  if (!done) return done.error();
  return made;
}

Outcome<std::optional<Pose>> Spaces::stage_from_local(XrTime time) const {
  if (!stage_) return std::optional<Pose>();
  return locate(local_.get(), stage_.get(), time);
}

Outcome<std::optional<Pose>> locate(XrSpace space, XrSpace base, XrTime time,
                                    glm::dvec3* velocity_m_per_s) {
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
  if ((location.locationFlags & kValid) != kValid) return std::optional<Pose>();
  return std::optional<Pose>(pose_of(location.pose));
}

}  // namespace palpate::xr
