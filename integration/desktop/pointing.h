#pragma once

#include <glm/glm.hpp>
#include <limits>

#include "module/view/eye.h"

namespace palpate::desktop {

/// Places in a picture: x from -1 at its left edge to 1 at its right, y from -1 at its bottom to 1
/// at its top.
using InPicture = glm::dvec2;

/// The place that appears at `cursor`, depth_m away along the eye's axis (not along the ray: a
/// cursor that moves stays in a plane parallel to the picture). World, m.
glm::dvec3 place_under(const Eye& eye, InPicture cursor, double depth_m);

/// How far a place is along the eye's axis, m; negative behind it.
double depth_of(const Eye& eye, glm::dvec3 place_m);

/// Where a place appears in the picture; it must be in front of the eye.
InPicture cursor_over(const Eye& eye, glm::dvec3 place_m);

/// A probe that is held by a mouse: it stays on the ray under the cursor, in a plane parallel to
/// the picture; the wheel moves that plane. Pressing by the wheel therefore presses what is under
/// the cursor. The depth is the probe's own and does not follow the surface: a wheel that is turned
/// back by one notch always gives back what one notch took. Values; world, m.
class Pointing {
 public:
  /// The probe starts here.
  explicit Pointing(glm::dvec3 place_m) : place_m_(place_m) {}

  /// How far along the eye's axis a probe may be, m: turning the wheel further at an end has no
  /// effect, and need not be turned back.
  struct Depths {
    double nearest_m = 0.01, furthest_m = std::numeric_limits<double>::infinity();
  };

  /// The cursor was moved or the wheel turned (m_forward > 0: away from the eye).
  void point(const Eye& eye, InPicture cursor, double m_forward, const Depths& depths);
  void point(const Eye& eye, InPicture cursor, double m_forward) {
    point(eye, cursor, m_forward, Depths{});
  }
  /// The eye moves but the hand does not: the probe stays where it is in the world, and the cursor
  /// takes hold of it there.
  void keep(const Eye& eye, InPicture cursor);
  /// The probe comes under the cursor, at the depth of `place_m`.
  void recentre(const Eye& eye, InPicture cursor, glm::dvec3 place_m);

  glm::dvec3 place_m() const { return place_m_; }

 private:
  glm::dvec3 place_m_;
  InPicture from_cursor_{0.0};  ///< where the probe is seen, from the cursor
};

}  // namespace palpate::desktop
