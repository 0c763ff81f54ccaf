#include "integration/desktop/pointing.h"

#include <algorithm>

namespace palpate::desktop {
namespace {

glm::dvec3 in_eye(const Eye& eye, glm::dvec3 place_m) {
  return glm::conjugate(eye.orientation) * (place_m - eye.position_m);
}

}  // namespace

glm::dvec3 place_under(const Eye& eye, InPicture cursor, double depth_m) {
  const glm::dvec2 share = 0.5 * (cursor + 1.0);
  const double right = eye.tan_left + share.x * (eye.tan_right - eye.tan_left);
  const double up = eye.tan_down + share.y * (eye.tan_up - eye.tan_down);
  return eye.position_m + eye.orientation * (depth_m * glm::dvec3(right, up, -1.0));
}

double depth_of(const Eye& eye, glm::dvec3 place_m) {
  return -in_eye(eye, place_m).z;
}

InPicture cursor_over(const Eye& eye, glm::dvec3 place_m) {
  const glm::dvec3 seen = in_eye(eye, place_m);
  const glm::dvec2 tangent = glm::dvec2(seen) / -seen.z;
  const glm::dvec2 low(eye.tan_left, eye.tan_down), high(eye.tan_right, eye.tan_up);
  return 2.0 * (tangent - low) / (high - low) - 1.0;
}

void Pointing::point(const Eye& eye, InPicture cursor, double m_forward, const Depths& depths) {
  const double depth_m = depth_of(eye, place_m_) + m_forward;
  place_m_ = place_under(eye, cursor + from_cursor_,
                         std::clamp(depth_m, depths.nearest_m, depths.furthest_m));
}

void Pointing::keep(const Eye& eye, InPicture cursor) {
  // An eye that moved past the probe can not see it; the cursor takes hold of it again where it
  // becomes visible.
  if (depth_of(eye, place_m_) > Depths{}.nearest_m)
    from_cursor_ = cursor_over(eye, place_m_) - cursor;
}

void Pointing::recentre(const Eye& eye, InPicture cursor, glm::dvec3 place_m) {
  from_cursor_ = InPicture(0.0);
  place_m_ = place_under(eye, cursor, std::max(Depths{}.nearest_m, depth_of(eye, place_m)));
}

}  // namespace palpate::desktop
