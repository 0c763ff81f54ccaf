#include "module/view/eye.h"

#include <cmath>

namespace palpate {

Eye eye_at(glm::dvec3 from, glm::dvec3 to, double height_angle, PictureSize size) {
  Eye eye;
  eye.position_m = from;
  const glm::dvec3 back = glm::normalize(from - to);
  glm::dvec3 right = glm::cross(glm::dvec3(0.0, 1.0, 0.0), back);
  // Looking straight up or down: any right will do.
  right = glm::length(right) > 1e-6 ? glm::normalize(right) : glm::dvec3(1.0, 0.0, 0.0);
  eye.orientation = glm::quat_cast(glm::dmat3(right, glm::cross(back, right), back));
  eye.tan_up = std::tan(0.5 * height_angle);
  eye.tan_right = eye.tan_up * size.width / size.height;
  eye.tan_down = -eye.tan_up;
  eye.tan_left = -eye.tan_right;
  return eye;
}

void split_eyes(const Eye& middle, double apart_m, Eye& left, Eye& right) {
  left = right = middle;
  const glm::dvec3 aside = middle.orientation * glm::dvec3(0.5 * apart_m, 0.0, 0.0);
  left.position_m -= aside;
  right.position_m += aside;
}

}  // namespace palpate
