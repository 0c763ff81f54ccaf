#include "compute/motion/discrete_start.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "compute/motion/gauss.h"

namespace palpate {
namespace {

// local SDs at which a difference is cut: larger ones cost the same
constexpr double kMostDifference = 1.5;
constexpr double kSmoothing = 0.5;  // nodes: SD of the Gaussian between rounds
// Penalty on a squared voxel of distance from the smooth field, per round: small at first, so that
// the choice is nearly free. The last one does not yet make all nodes agree, since motion is
// searched for that differs from its surroundings.
constexpr std::array<double, 4> kPrices = {0.0005, 0.005, 0.0125, 0.03};

}  // namespace

DiscreteStart::DiscreteStart(std::shared_ptr<vulkan::Context> context,
                             std::shared_ptr<MotionKernels> kernels, const MotionPlan& plan,
                             const SearchPlan& search)
    : context_(std::move(context)),
      kernels_(std::move(kernels)),
      search_(search),
      level_(plan.levels[search.level]),
      list_(context_, search.count() * sizeof(uint32_t), vulkan::Buffer::Kind::kFilledByHost),
      places_(context_, search.count() * sizeof(int32_t), vulkan::Buffer::Kind::kFilledByHost),
      bricks_(upload_bricks(context_, all_bricks(search.nodes))),
      recorder_(context_) {
  for (vulkan::Image* image : {&base_, &choice_, &smooth_, &scratch_}) {
    *image = vulkan::Image(context_, search.nodes, VK_FORMAT_R32G32B32A32_SFLOAT);
    recorder_.prepare(*image);
  }
  recorder_.run();
}

void DiscreteStart::record_cost(vulkan::Recorder& recorder, const FramePyramid& fixed,
                                const FramePyramid& moving, const Costs& cost, int count,
                                glm::ivec3 reach) {
  const glm::ivec3 n = search_.nodes;
  const glm::ivec3 groups{(count + 63) / 64, SearchPlan::labels(reach), 1};
  const vulkan::Sampler& nearest = kernels_->nearest();
  recorder.dispatch(kernels_->matching_cost(),
                    {list_,
                     {fixed.level(search_.level), nearest},
                     {moving.level(search_.level), nearest},
                     {base_, nearest},
                     cost[0]},
                    shaders::MatchingPush{glm::ivec4(level_.image_size, 0), glm::ivec4(n, count),
                                          glm::ivec4(search_.cell, 0), glm::ivec4(reach, 0),
                                          glm::vec4(level_.spacing_mm, kMostDifference)},
                    groups);
  for (int axis = 0; axis < 3; ++axis) {
    recorder.dispatch(kernels_->smooth_cost(), {list_, places_, cost[axis % 2], cost[1 - axis % 2]},
                      shaders::SmoothCostPush{glm::ivec4(n, axis), {count, 0, 0, 0}}, groups);
  }
}

void DiscreteStart::record_rounds(vulkan::Recorder& recorder, const vulkan::Buffer& cost, int count,
                                  glm::ivec3 reach) {
  const glm::ivec3 n = search_.nodes;
  const glm::dvec3 node_mm = level_.spacing_mm * glm::dvec3(search_.cell);
  const double widest = std::max({node_mm.x, node_mm.y, node_mm.z});
  const vulkan::Sampler& nearest = kernels_->nearest();
  const vulkan::Image* smooth = &base_;
  for (const double price : kPrices) {
    recorder.dispatch(kernels_->coupled_choice(),
                      {places_, cost, {*smooth, nearest}, {base_, nearest}, choice_},
                      shaders::CoupledChoicePush{glm::ivec4(n, count), glm::ivec4(reach, 0),
                                                 glm::vec4(level_.spacing_mm, price)},
                      {(n.x * n.y * n.z + 63) / 64, 1, 1});
    if (price == kPrices.back()) return;
    const glm::dvec3 sigma = kSmoothing * widest / node_mm;
    record_gauss(recorder, *kernels_, bricks_, brick_groups(all_bricks(n)), sigma, {&choice_},
                 {&smooth_}, {&scratch_});
    const int passes = gauss_passes(n, sigma);
    smooth = passes == 0 ? &choice_ : passes % 2 == 1 ? &smooth_ : &scratch_;
  }
}

int DiscreteStart::solve(const FramePyramid& fixed, const FramePyramid& moving,
                         const vulkan::Image& current, const std::vector<uint32_t>& nodes,
                         Costs& costs) {
  const glm::ivec3 reach = search_.reach_for(nodes.size());
  const int labels = SearchPlan::labels(reach);
  if (nodes.empty() || labels <= 1) return 0;
  const uint64_t bytes = nodes.size() * uint64_t(labels) * sizeof(float);
  for (vulkan::Buffer& cost : costs)
    if (cost.bytes() < bytes) cost = vulkan::Buffer(context_, bytes);
  std::copy(nodes.begin(), nodes.end(), list_.as<uint32_t>().begin());
  const auto places = places_.as<int32_t>();
  std::fill(places.begin(), places.end(), -1);
  for (size_t i = 0; i < nodes.size(); ++i) places[nodes[i]] = int32_t(i);

  recorder_.restart();
  const glm::ivec3 n = search_.nodes;
  const glm::dvec3 scale = glm::dvec3(search_.cell) / glm::dvec3(level_.cell);
  recorder_.dispatch(kernels_->upsample(), {{current, kernels_->linear()}, base_, smooth_},
                     shaders::UpsamplePush{glm::ivec4(n, 0), glm::ivec4(level_.cells, 0),
                                           glm::vec4(scale, 0), glm::vec4(0.5 * scale - 0.5, 0)},
                     {(n.x + 63) / 64, n.y, n.z});
  record_cost(recorder_, fixed, moving, costs, int(nodes.size()), reach);
  record_rounds(recorder_, costs[1], int(nodes.size()), reach);
  recorder_.run();
  return labels;
}

}  // namespace palpate
