#pragma once

#include <array>

#include "module/scene/transform.h"
#include "module/xr/hands.h"

namespace palpate::xr {

/// A plane in the world: what lies on the side of the normal is kept.
struct CutPlane {
  glm::dvec3 point_m{0.0};
  glm::dvec3 normal{0.0, 1.0, 0.0};  ///< unit length
};

struct GrabLimits {
  double scale_min = 0.1, scale_max = 10.0;  ///< of each axis of the volume
  /// Hands closer than this turn and move, but do not scale: the ratio of two small distances is
  /// noise.
  double apart_m = 0.03;
};

/// Moves a volume by the hands that hold it. One hand: it moves and turns with the hand. Two hands:
/// what is under each hand stays there, so it moves, turns and scales; turning both hands about the
/// line between them rolls it by their mean. It never jumps when a hand lets go or takes hold.
///
/// A value: the state is which hands held on, and where, in the last frame. The movement is put
/// together from frame to frame: that is exact for the points under the hands (quotients and
/// products telescope) and has no singular direction, as the turn from a remembered start would.
class Grab {
 public:
  explicit Grab(GrabLimits limits = {}) : limits_(limits) {}

  /// world_from_volume after this frame. Hands that are not active or not focused hold nothing.
  Transform drag(const Transform& world_from_volume, const Hands& hands);

  /// One or two hands held on in the last frame.
  bool holds() const { return held_[0] || held_[1]; }

 private:
  Transform by_one(const Transform& volume, const Pose& before, const Pose& now) const;
  Transform by_two(const Transform& volume, const std::array<Pose, 2>& now) const;

  GrabLimits limits_;
  std::array<bool, 2> held_{};
  std::array<Pose, 2> last_{};
};

/// The plane of a flat hand that holds a controller; the palm's side is kept. hand: 0 left, 1
/// right.
CutPlane clip_plane(const Pose& world_from_grip, int hand);

/// The volume brought to a place: its centre (volume space, m) at `target_m`, turned about the
/// vertical so that its front (+z, the patient's chest) looks to `viewer_m`; scale kept. From
/// straight above or below it keeps its turn.
Transform brought_to(const Transform& world_from_volume, glm::dvec3 centre_m, glm::dvec3 target_m,
                     glm::dvec3 viewer_m);

/// The dead-man of either hand: without it a force device stays limp, if the scene asks for one.
inline bool dead_man_held(const Hands& hands) {
  return hands.focused && (hands.hand[0].dead_man || hands.hand[1].dead_man);
}

}  // namespace palpate::xr
