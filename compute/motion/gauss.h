#pragma once

#include <vector>

#include "compute/motion/bricks.h"
#include "compute/motion/kernels.h"
#include "compute/vulkan/recorder.h"

namespace palpate {

/// Push constants of one axis of a Gaussian of `sigma` samples. Weights are cut at 3 sigma and sum
/// to 1; radius 0 if the filter would change nothing.
shaders::GaussPush gauss_push(glm::ivec3 size, int axis, double sigma);

/// Number of passes: axes along which the Gaussian smooths at all.
int gauss_passes(glm::ivec3 size, glm::dvec3 sigma);

/// True if record_gauss leaves its result in `b`.
bool gauss_swaps(glm::ivec3 size, glm::dvec3 sigma);

/// Records the separable Gaussian of `sigma` (samples per axis) over several images at once,
/// ping-ponging between `a` (where the data are) and `b`; returns true if the result is in `b`.
/// Axes that need no smoothing are left out.
bool record_gauss(vulkan::Recorder& recorder, MotionKernels& kernels, const vulkan::Buffer& bricks,
                  glm::ivec3 groups, glm::dvec3 sigma, const std::vector<const vulkan::Image*>& a,
                  const std::vector<const vulkan::Image*>& b);

/// The same from `source`, which is not changed, over `first` and `second` in turns. With an odd
/// number of passes (gauss_passes) the result is in `first`, with an even one in `second`, with
/// none `source` is the result. `second` may be `source`.
void record_gauss(vulkan::Recorder& recorder, MotionKernels& kernels, const vulkan::Buffer& bricks,
                  glm::ivec3 groups, glm::dvec3 sigma,
                  const std::vector<const vulkan::Image*>& source,
                  const std::vector<const vulkan::Image*>& first,
                  const std::vector<const vulkan::Image*>& second);

}  // namespace palpate
