#pragma once

#include <memory>
#include <vector>

#include "module/scene/motion_map.h"

namespace palpate {

/// What has to be added to the last step of a cycle so that the material at `last` (in the last
/// frame, volume space, m) comes back to where it started. Fields that are sampled on a grid have
/// small errors, so their composition over a cycle is not the identity, and a still hand would
/// drift with every beat. The start of this material is found by running the cycle, a few reads per
/// step and only once per beat. Zero if it can not be found (no closing is better than a wrong
/// one). Steps that are null stand still. Real-time safe.
glm::dvec3 closing_forward(const std::vector<std::shared_ptr<const MotionMap>>& steps,
                           glm::dvec3 last) noexcept;

/// The same when the cycle is entered backwards, from its first frame: `first` is the material's
/// place there.
glm::dvec3 closing_backward(const std::vector<std::shared_ptr<const MotionMap>>& steps,
                            glm::dvec3 first) noexcept;

}  // namespace palpate
