#include "compute/motion/gauss.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr double kCut = 3.0;            // SDs: what is left out weighs 0.3 %
constexpr double kSmallestSigma = 0.3;  // samples: the neighbour would weigh 0.4 %

}  // namespace

shaders::GaussPush gauss_push(glm::ivec3 size, int axis, double sigma) {
  shaders::GaussPush push{};
  push.size = glm::ivec4(size, axis);
  if (sigma < kSmallestSigma || size[axis] == 1) {
    push.weights[0][0] = 1.0F;
    return push;
  }
  const int radius = std::min(shaders::kMaxRadius, int(std::ceil(kCut * sigma)));
  double sum = 0.0;
  for (int k = -radius; k <= radius; ++k) sum += std::exp(-0.5 * k * k / (sigma * sigma));
  for (int k = 0; k <= radius; ++k) {
    push.weights[k / 4][k % 4] = float(std::exp(-0.5 * k * k / (sigma * sigma)) / sum);
  }
  push.radius.x = radius;
  return push;
}

bool gauss_swaps(glm::ivec3 size, glm::dvec3 sigma) {
  bool swaps = false;
  for (int axis = 0; axis < 3; ++axis) swaps ^= gauss_push(size, axis, sigma[axis]).radius.x > 0;
  return swaps;
}

bool record_gauss(vulkan::Recorder& recorder, MotionKernels& kernels, const vulkan::Buffer& bricks,
                  glm::ivec3 groups, glm::dvec3 sigma, const std::vector<const vulkan::Image*>& a,
                  const std::vector<const vulkan::Image*>& b) {
  bool in_b = false;
  for (int axis = 0; axis < 3; ++axis) {
    const shaders::GaussPush push = gauss_push(a[0]->size(), axis, sigma[axis]);
    if (push.radius.x == 0) continue;
    recorder.begin_concurrent();
    for (size_t i = 0; i < a.size(); ++i) {
      const vulkan::Image& from = in_b ? *b[i] : *a[i];
      const vulkan::Image& to = in_b ? *a[i] : *b[i];
      recorder.dispatch(kernels.gauss(), {bricks, {from, kernels.nearest()}, to}, push, groups);
    }
    recorder.end_concurrent();
    in_b = !in_b;
  }
  return in_b;
}

}  // namespace palpate
