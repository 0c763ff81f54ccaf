#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "module/scene/calibrate.h"
#include "module/scene/small_linear.h"

namespace palpate {

/// RMS rotation about the second of the three principal axes of rotation; robust against single
/// wild poses, because it is used to refuse.
inline double rotation_spread_rad(std::span<const ControllerSample> controller) {
  linear::Matrix<3> spread{};
  const glm::dquat middle = controller[controller.size() / 2].stage_from_controller.rotation;
  glm::dvec3 mean(0.0);
  std::vector<glm::dvec3> turns;
  for (const ControllerSample& sample : controller) {
    glm::dquat turn = glm::conjugate(middle) * sample.stage_from_controller.rotation;
    if (turn.w < 0.0) turn = -turn;
    turns.push_back(2.0 * glm::dvec3(turn.x, turn.y, turn.z));
    mean += turns.back() / double(controller.size());
  }
  for (const glm::dvec3& turn : turns)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        spread[size_t(i)][size_t(j)] +=
            (turn[i] - mean[i]) * (turn[j] - mean[j]) / double(turns.size());
  return std::sqrt(std::max(0.0, linear::eigen(spread).values[1]));
}

}  // namespace palpate
