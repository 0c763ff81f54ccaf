#include "compute/motion/discrete_start.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "compute/motion/gauss.h"

namespace palpate {
namespace {

constexpr double kCut = 1.5;  // local SDs: a larger difference says no more than "does not match"
constexpr double kSmoothing = 1.0;  // nodes: SD of the Gaussian between rounds
// Price of a squared voxel of distance from the smooth field, round by round: free choice first,
// agreement last.
constexpr std::array<double, 6> kPrices = {0.0, 0.01, 0.025, 0.0625, 0.156, 0.39};

}  // namespace

DiscreteStart::DiscreteStart(std::shared_ptr<vulkan::Context> context,
                             std::shared_ptr<MotionKernels> kernels, const MotionPlan& plan,
                             const SearchPlan& search)
    : context_(std::move(context)),
      kernels_(std::move(kernels)),
      search_(search),
      spacing_mm_(plan.levels[search.level].spacing_mm),
      image_size_(plan.levels[search.level].image_size),
      bricks_(upload_bricks(context_, all_bricks(search.nodes))),
      choice_(context_, search.nodes, VK_FORMAT_R32G32B32A32_SFLOAT),
      smooth_(context_, search.nodes, VK_FORMAT_R32G32B32A32_SFLOAT) {
  const glm::ivec3 n = search_.nodes;
  const uint64_t bytes =
      uint64_t(n.x) * uint64_t(n.y) * uint64_t(n.z) * uint64_t(search_.labels()) * sizeof(float);
  for (vulkan::Buffer& cost : cost_) cost = vulkan::Buffer(context_, bytes);
  vulkan::Recorder recorder(context_);
  recorder.prepare(choice_);
  recorder.prepare(smooth_);
  recorder.run();
}

void DiscreteStart::record_cost(vulkan::Recorder& recorder, const FramePyramid& fixed,
                                const FramePyramid& moving) {
  const glm::ivec3 n = search_.nodes;
  const glm::ivec3 groups{(n.x * n.y * n.z + 63) / 64, search_.labels(), 1};
  recorder.dispatch(kernels_->matching_cost(),
                    {{fixed.level(search_.level), kernels_->nearest()},
                     {moving.level(search_.level), kernels_->nearest()},
                     cost_[0]},
                    shaders::MatchingPush{glm::ivec4(image_size_, 0),
                                          glm::ivec4(n, 0),
                                          glm::ivec4(search_.cell, 0),
                                          glm::ivec4(search_.reach, 0),
                                          {float(kCut), 0, 0, 0}},
                    groups);
  for (int axis = 0; axis < 3; ++axis) {
    recorder.dispatch(kernels_->smooth_cost(), {cost_[axis % 2], cost_[1 - axis % 2]},
                      shaders::SmoothCostPush{glm::ivec4(n, axis)}, groups);
  }
}

void DiscreteStart::record_rounds(vulkan::Recorder& recorder) {
  const glm::ivec3 n = search_.nodes;
  const glm::dvec3 node_mm = spacing_mm_ * glm::dvec3(search_.cell);
  const double widest = std::max({node_mm.x, node_mm.y, node_mm.z});
  result_ = &smooth_;
  for (size_t round = 0; round < kPrices.size(); ++round) {
    const vulkan::Image& from = *result_;
    const vulkan::Image& to = result_ == &smooth_ ? choice_ : smooth_;
    recorder.dispatch(
        kernels_->coupled_choice(), {cost_[1], {from, kernels_->nearest()}, to},
        shaders::CoupledChoicePush{glm::ivec4(n, 0), glm::ivec4(search_.reach, round == 0),
                                   glm::vec4(spacing_mm_, kPrices[round])},
        {(n.x * n.y * n.z + 63) / 64, 1, 1});
    const bool swapped = record_gauss(recorder, *kernels_, bricks_, brick_groups(all_bricks(n)),
                                      kSmoothing * widest / node_mm, {&to}, {&from});
    result_ = swapped ? &from : &to;
  }
}

void DiscreteStart::solve(const FramePyramid& fixed, const FramePyramid& moving) {
  vulkan::Recorder recorder(context_, 64);
  record_cost(recorder, fixed, moving);
  record_rounds(recorder);
  recorder.run();
}

}  // namespace palpate
