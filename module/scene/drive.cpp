#include "module/scene/drive.h"

#include <cmath>
#include <glm/gtc/constants.hpp>

namespace palpate {

Transform driven(const DriveSpec& drive, const Transform& start, double time_s) noexcept {
  const double angle = glm::two_pi<double>() * drive.rate_hz * time_s;
  const double length = glm::length(drive.axis);
  if (!(length > 0.0) || !std::isfinite(angle)) return start;
  const glm::dvec3 axis = drive.axis / length;
  Transform pose = start;
  if (drive.kind == DriveSpec::Kind::kTurn) {
    const glm::dquat turn = glm::angleAxis(angle, axis);
    pose.rotation = glm::normalize(turn * start.rotation);
    pose.translation_m = drive.centre_m + turn * (start.translation_m - drive.centre_m);
  } else if (drive.kind == DriveSpec::Kind::kSwing) {
    pose.translation_m += axis * (drive.amplitude_m * std::sin(angle));
  }
  return pose;
}

}  // namespace palpate
