#pragma once

#include <optional>

#include "module/xr/colocation.h"
#include "module/xr/headset.h"
#include "module/xr/session.h"

namespace palpate::xr {

/// Fifth in the life cycle: the reference spaces. Frames are located in the base space; the other
/// one of stage and local is kept to notice and repair unannounced moves of the base. Local is
/// LOCAL, or LOCAL_FLOOR where that is the base: it moves with LOCAL, but has a height of its own.
/// Move-only.
class Spaces {
 public:
  static Outcome<Spaces> make(const OpenXrSession& session, const System& system, Origin wanted);

  /// The space in which views and hands are located.
  XrSpace base() const { return base_.get(); }
  Origin origin() const { return origin_; }
  /// Which of the two is what a space of this type is about; none: neither.
  std::optional<Room> room_of(XrReferenceSpaceType type) const;

  /// stage_from_local at a time; none while the runtime does not know it or offers only one.
  Outcome<std::optional<Pose>> stage_from_local(XrTime time) const;

  /// Whether the runtime sees at this time where the person looks; false where no view follows
  /// that.
  Outcome<bool> knows_gaze(XrTime time) const;

 private:
  using Space = XrHandle<XrSpace, xrDestroySpace>;
  Space base_, stage_, local_, gaze_;
  Origin origin_ = Origin::kLocal;
};

/// base_from_space at a time, or none where position and orientation are not both valid, or, if
/// `tracked` is asked for, where the runtime guesses the position. velocity: filled in where the
/// runtime knows it.
Outcome<std::optional<Pose>> locate(XrSpace space, XrSpace base, XrTime time,
                                    glm::dvec3* velocity_m_per_s = nullptr, bool tracked = false);

}  // namespace palpate::xr
