#include "compute/motion/gauss.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr double kGaussReach = 3.0;     // SDs: the weight beyond is 0.3 %
constexpr double kSmallestSigma = 0.3;  // samples: the weight of a neighbour would be 0.4 %

}  // namespace

shaders::GaussPush gauss_push(glm::ivec3 size, int axis, double sigma) {
  shaders::GaussPush push{};
  push.size = glm::ivec4(size, axis);
  if (sigma < kSmallestSigma || size[axis] == 1) {
    push.weights[0][0] = 1.0F;
    return push;
  }
  const int radius = std::min(shaders::kMaxRadius, int(std::ceil(kGaussReach * sigma)));
  double sum = 0.0;
  for (int k = -radius; k <= radius; ++k) sum += std::exp(-0.5 * k * k / (sigma * sigma));
  for (int k = 0; k <= radius; ++k) {
    push.weights[k / 4][k % 4] = float(std::exp(-0.5 * k * k / (sigma * sigma)) / sum);
  }
  push.radius.x = radius;
  return push;
}

int gauss_passes(glm::ivec3 size, glm::dvec3 sigma) {
  int passes = 0;
  for (int axis = 0; axis < 3; ++axis) passes += gauss_push(size, axis, sigma[axis]).radius.x > 0;
  return passes;
}

bool gauss_swaps(glm::ivec3 size, glm::dvec3 sigma) {
  return gauss_passes(size, sigma) % 2 == 1;
}

bool record_gauss(vulkan::Recorder& recorder, MotionKernels& kernels, const vulkan::Buffer& bricks,
                  glm::ivec3 groups, glm::dvec3 sigma, const std::vector<const vulkan::Image*>& a,
                  const std::vector<const vulkan::Image*>& b) {
  record_gauss(recorder, kernels, bricks, groups, sigma, a, b, a);
  return gauss_swaps(a[0]->size(), sigma);
}

void record_gauss(vulkan::Recorder& recorder, MotionKernels& kernels, const vulkan::Buffer& bricks,
                  glm::ivec3 groups, glm::dvec3 sigma,
                  const std::vector<const vulkan::Image*>& source,
                  const std::vector<const vulkan::Image*>& first,
                  const std::vector<const vulkan::Image*>& second) {
  const std::vector<const vulkan::Image*>* from = &source;
  const std::vector<const vulkan::Image*>* to = &first;
  for (int axis = 0; axis < 3; ++axis) {
    const shaders::GaussPush push = gauss_push(source[0]->size(), axis, sigma[axis]);
    if (push.radius.x == 0) continue;
    recorder.begin_concurrent();
    for (size_t i = 0; i < source.size(); ++i) {
      recorder.dispatch(kernels.gauss(push.radius.x, (*from)[i]->format()),
                        {bricks, {*(*from)[i], kernels.nearest()}, *(*to)[i]}, push, groups);
    }
    recorder.end_concurrent();
    from = to;
    to = to == &first ? &second : &first;
  }
}

}  // namespace palpate
