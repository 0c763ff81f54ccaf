#pragma once

#include <optional>
#include <string>

#include "module/session/scene_picture.h"
#include "module/session/session.h"
#include "module/xr/grab.h"

namespace palpate::headset {

/// What the hands that hold controllers do with the scene: grab and scale it, cut it with a palm,
/// play and scrub it, change its look. All volumes go together, as they lie in one patient. One
/// thread.
class SceneHands {
 public:
  /// Borrowed.
  SceneHands(Session& session, const ViewChoices& view) : session_(session), view_(view) {}

  /// Once per frame, dt_s after the one before.
  void step(const xr::Hands& hands, const SceneSnapshot& snapshot, double dt_s);
  /// Brings what is around `centre_m` (world, now) to `target_m`, its front to the viewer.
  void bring(glm::dvec3 centre_m, glm::dvec3 target_m, glm::dvec3 viewer_m);

  /// The look that the person has chosen, if any.
  const ViewChoices& view() const { return view_; }
  /// The cut that is to be seen where `drawn` is drawn: at the palm that holds it, or in the
  /// volumes where it was let go. Once per picture.
  std::optional<ClipPlane> clip(const SceneSnapshot& drawn);

 private:
  void hold_cut(const xr::Hands& hands, double dt_s);
  Transform drawn_from_start(const SceneSnapshot& drawn) const;
  void move_to(const Transform& world_from_start);
  void next_look(int steps);

  Session& session_;
  ViewChoices view_;
  xr::Grab grab_;
  Transform world_from_start_;  ///< where the hands have taken all volumes from their start
  std::optional<xr::CutPlane> held_cut_;  ///< world, by a palm, now
  std::optional<xr::CutPlane> cut_;       ///< in the volumes at their start
  double cut_held_s_ = 0.0;
};

}  // namespace palpate::headset
