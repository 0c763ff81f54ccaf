#pragma once

#include <glm/glm.hpp>

#include "module/view/eye.h"

namespace palpate::desktop {

/// A camera on a ball around what it looks at. World: m, y up.
struct Camera {
  glm::dvec3 target_m{0.0};
  double azimuth = 0.0;    ///< radians around y; 0 looks along -z, positive from the right
  double elevation = 0.0;  ///< radians above the horizon
  double distance_m = 0.5;
  double height_angle = 0.6;  ///< of the whole picture, radians
  double nearest_m = 0.05, furthest_m = 5.0;

  bool operator==(const Camera&) const = default;
};

/// How far the camera may rise or dive, radians: straight above there is no upright picture.
inline constexpr double kSteepest = 1.5;

/// A camera that sees a whole ball, a little from the right and above; the picture is at least as
/// wide as high.
Camera camera_before(glm::dvec3 centre_m, double radius_m);

/// The same camera turned around its target by so many radians to the right and upwards. Elevation
/// is held at kSteepest; the azimuth goes round for ever within [-pi, pi]. A turn that is not a
/// number does nothing.
Camera orbit(Camera camera, double right, double up);

/// The same camera at its distance times `factor` (> 1: further away), within nearest and furthest.
/// A factor that is not above 0 does nothing.
Camera zoom(Camera camera, double factor);

/// The camera as an eye for a picture of this size.
Eye eye_of(const Camera& camera, PictureSize size);

}  // namespace palpate::desktop
