#pragma once

#include <optional>
#include <string>

#include "module/session/scene_picture.h"
#include "module/session/session.h"
#include "module/xr/grab.h"

namespace palpate::headset {

/// What hands with controllers do with the scene: grab and scale it, cut it with a palm, play and
/// scrub it, change its look. All volumes move together, since they belong to one patient. One
/// thread.
class SceneHands {
 public:
  /// Both arguments are borrowed.
  SceneHands(Session& session, const ViewChoices& view) : session_(session), view_(view) {}

  /// Once per frame, dt_s after the one before.
  void step(const xr::Hands& hands, const SceneSnapshot& snapshot, double dt_s);
  /// Moves what is at `centre_m` (world, now) to `target_m` and turns its front to the viewer.
  void bring(glm::dvec3 centre_m, glm::dvec3 target_m, glm::dvec3 viewer_m);

  /// The view with the look that the person has chosen.
  const ViewChoices& view() const { return view_; }
  /// The cut for a picture in which the scene is drawn as in `drawn`: at the palm that holds it, or
  /// at the place in the volumes where it was released. Once per picture.
  std::optional<ClipPlane> clip(const SceneSnapshot& drawn);

 private:
  void hold_cut(const xr::Hands& hands, double dt_s);
  Transform drawn_from_start(const SceneSnapshot& drawn) const;
  void move_to(const Transform& world_from_start);
  void next_look(int steps);

  Session& session_;
  ViewChoices view_;
  xr::Grab grab_;
  Transform world_from_start_;            ///< how the hands have moved all volumes from their start
  std::optional<xr::CutPlane> held_cut_;  ///< world, held by a palm
  std::optional<xr::CutPlane> cut_;       ///< in the volumes at their start
  double cut_held_s_ = 0.0;
};

}  // namespace palpate::headset
