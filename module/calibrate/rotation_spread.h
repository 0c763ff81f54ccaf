#pragma once

#include <cmath>
#include <span>
#include <vector>

#include "module/calibrate/calibrate.h"
#include "module/calibrate/principal_axes.h"

namespace palpate {

/// RMS rotation, rad, about the second of the three principal axes of rotation. Robust against
/// single outliers, because calibrations are refused by it.
inline double rotation_spread_rad(std::span<const ControllerSample> controller) {
  const glm::dquat middle = controller[controller.size() / 2].stage_from_controller.rotation;
  std::vector<glm::dvec3> rotations;
  rotations.reserve(controller.size());
  for (const ControllerSample& sample : controller) {
    glm::dquat rotation = glm::conjugate(middle) * sample.stage_from_controller.rotation;
    if (rotation.w < 0.0) rotation = -rotation;
    rotations.push_back(2.0 * glm::dvec3(rotation.x, rotation.y, rotation.z));
  }
  return std::sqrt(principal_axes(rotations).variance[1]);
}

}  // namespace palpate
