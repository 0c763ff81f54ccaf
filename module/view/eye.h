#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

namespace palpate {

/// One eye, as OpenXR gives it: a pose in the world (m, right-handed, looking along -z of its own
/// axes, y up) and the tangents of the four angles of view (left and down are negative).
struct Eye {
  glm::dvec3 position_m{0.0};
  glm::dquat orientation{1.0, 0.0, 0.0, 0.0};  ///< world from eye; unit length
  double tan_left = -0.5, tan_right = 0.5, tan_down = -0.5, tan_up = 0.5;
  bool operator==(const Eye&) const = default;
};

/// How many pixels each eye has; row 0 is at the top.
struct PictureSize {
  int width = 0, height = 0;
  bool operator==(const PictureSize&) const = default;
};

/// An eye at `from` that looks at `to`, with the world's y upwards, and symmetric angles: for
/// pictures without a headset. height_angle: of the whole picture, radians.
Eye eye_at(glm::dvec3 from, glm::dvec3 to, double height_angle, PictureSize size);

/// The two eyes of a head whose middle is `middle`: apart_m (0.063 for most people) along its x
/// axis, left one first, parallel.
void split_eyes(const Eye& middle, double apart_m, Eye& left, Eye& right);

}  // namespace palpate
