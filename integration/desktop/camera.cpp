#include "integration/desktop/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate::desktop {
namespace {

constexpr double kAtFirstRight = 0.45, kAtFirstUp = 0.30;  // radians: sides and top are seen
constexpr double kRoom = 1.08;                             // of the ball in the picture's height

}  // namespace

Camera camera_before(glm::dvec3 centre_m, double radius_m) {
  Camera camera;
  camera.target_m = centre_m;
  camera.azimuth = kAtFirstRight;
  camera.elevation = kAtFirstUp;
  const double radius = radius_m > 0.0 && std::isfinite(radius_m) ? radius_m : 0.1;
  // A ball touches the cone of view where sin of half its angle is radius / distance.
  camera.distance_m = kRoom * radius / std::sin(0.5 * camera.height_angle);
  camera.nearest_m = 0.2 * radius;
  camera.furthest_m = 8.0 * camera.distance_m;
  return camera;
}

Camera orbit(Camera camera, double right, double up) {
  if (!std::isfinite(right) || !std::isfinite(up)) return camera;
  camera.azimuth = std::remainder(camera.azimuth + right, 2.0 * std::numbers::pi);
  camera.elevation = std::clamp(camera.elevation + up, -kSteepest, kSteepest);
  return camera;
}

Camera zoom(Camera camera, double factor) {
  if (!(factor > 0.0) || !std::isfinite(factor)) return camera;
  camera.distance_m = std::clamp(camera.distance_m * factor, camera.nearest_m, camera.furthest_m);
  return camera;
}

Eye eye_of(const Camera& camera, PictureSize size) {
  const double flat = std::cos(camera.elevation);
  const glm::dvec3 towards_eye(flat * std::sin(camera.azimuth), std::sin(camera.elevation),
                               flat * std::cos(camera.azimuth));
  return eye_at(camera.target_m + camera.distance_m * towards_eye, camera.target_m,
                camera.height_angle, size);
}

}  // namespace palpate::desktop
