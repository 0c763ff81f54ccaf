#include "tests/lab/bench/motion_steps.h"

#include <algorithm>

#include "compute/motion/gauss.h"

namespace palpate::bench {
namespace {

// Bytes of one texel in the engine's images.
constexpr double kScalar = 2.0;   // r16f
constexpr double kHalves = 8.0;   // rgba16f
constexpr double kFloats = 16.0;  // rgba32f
constexpr double kFramesOfPair = 2.0;

double product(glm::ivec3 v) {
  return double(v.x) * double(v.y) * double(v.z);
}

glm::ivec4 wide(glm::ivec3 v, int w = 0) {
  return {v, w};
}

glm::ivec3 rows_of(glm::ivec3 size) {
  return {(size.x + 63) / 64, size.y, size.z};
}

/// The number of axes that a Gaussian filters.
int axes(glm::ivec3 size, glm::dvec3 sigma) {
  int count = 0;
  for (int a = 0; a < 3; ++a) count += gauss_push(size, a, sigma[a]).radius.x > 0;
  return count;
}

}  // namespace

LevelSteps::LevelSteps(const std::shared_ptr<vulkan::Context>& context, WarmPair& pair,
                       size_t level, const LevelReport* report)
    : pair_(pair), l_(level), level_(pair.plan().levels[level]) {
  voxels_ = product(level_.image_size);
  cells_ = product(level_.cells);
  moment_cells_ = product(level_.moment_cells);
  vulkan::Recorder recorder(context);
  // Cleared, because a new image may contain denormal numbers, which are slow on some devices.
  const auto make = [&](vulkan::Image& image, glm::ivec3 size, VkFormat format) {
    image = vulkan::Image(context, size, format);
    recorder.prepare(image);
    recorder.clear(image);
  };
  make(raw_, level_.image_size, VK_FORMAT_R16_SFLOAT);
  make(finer_, l_ ? pair.plan().levels[l_ - 1].image_size : glm::ivec3(1), VK_FORMAT_R16_SFLOAT);
  make(normalised_, level_.image_size, VK_FORMAT_R16_SFLOAT);
  make(packed_, level_.image_size, VK_FORMAT_R16G16B16A16_SFLOAT);
  make(no_mask_, glm::ivec3(1), VK_FORMAT_R8_UNORM);
  for (auto& moments : moments_) make(moments, level_.moment_cells, VK_FORMAT_R32G32B32A32_SFLOAT);
  for (vulkan::Image* image : {&field_, &ahead_, &composed_, &primal_})
    make(*image, level_.cells, VK_FORMAT_R32G32B32A32_SFLOAT);
  make(seen_, level_.cells, VK_FORMAT_R16G16B16A16_SFLOAT);
  for (auto* images : {equations_, smoothed_, dual_}) {
    for (int k = 0; k < 3; ++k) make(images[k], level_.cells, VK_FORMAT_R16G16B16A16_SFLOAT);
  }
  for (vulkan::Image& q : second_) make(q, level_.cells, VK_FORMAT_R16G16B16A16_SFLOAT);
  recorder.run();
  bricks_ = all_bricks(level_.cells);
  moment_bricks_ = all_bricks(level_.moment_cells);
  list_ = upload_bricks(context, bricks_);
  moment_list_ = upload_bricks(context, moment_bricks_);
  measures_ = vulkan::Buffer(context, 3 * sizeof(float) * bricks_.size(),
                             vulkan::Buffer::Kind::kHostVisible);
  staging_ = vulkan::Buffer(context, l_ == 0 ? uint64_t(voxels_) * 2 : 4,
                            vulkan::Buffer::Kind::kHostVisible);

  add_pyramid();
  if (!report || report->all_brick_iterations <= 0.0) return;
  // Iterations in which only some bricks were computed count as this fraction of one.
  const double iterations = report->brick_iterations / double(bricks_.size());
  const bool by_turns = pair.plan().options.checkerboard;
  const double all = by_turns ? std::min(1.0, iterations) : iterations;
  add_data_term(all, iterations - all);
  add_window(iterations);
  add_update(iterations);
  add_filter(iterations);
  add_measure(pair.plan().options.converged > 0.0 ? iterations / 5.0 : 0.0);
}

void LevelSteps::add_pyramid() {
  MotionKernels& kernels = *pair_.kernels();
  const glm::ivec4 size = wide(level_.image_size);
  const glm::ivec4 cells = wide(level_.moment_cells);
  const glm::ivec4 cell = wide(level_.moment_cell);
  if (l_ == 0) {
    steps_.push_back({"upload", 2.0 * kScalar * voxels_, kFramesOfPair, 0,
                      [this](vulkan::Recorder& r) { r.copy(staging_, raw_); }});
  } else {
    const shaders::DownsamplePush push{wide(pair_.plan().levels[l_ - 1].image_size), size,
                                       wide(level_.ratio)};
    steps_.push_back({"downsample", kScalar * (voxels_ + product(finer_.size())), kFramesOfPair, 1,
                      [this, push, &kernels](vulkan::Recorder& r) {
                        r.dispatch(kernels.downsample(), {{finer_, kernels.linear()}, raw_}, push,
                                   rows_of(level_.image_size));
                      }});
  }
  if (pair_.plan().options.normalise) {
    steps_.push_back({"local moments", kScalar * voxels_ + kFloats * moment_cells_, kFramesOfPair,
                      1, [this, size, cells, cell, &kernels](vulkan::Recorder& r) {
                        r.dispatch(kernels.moments(), {{raw_, kernels.nearest()}, moments_[0]},
                                   shaders::MomentsPush{size, cells, cell},
                                   rows_of(level_.moment_cells));
                      }});
    const glm::dvec3 sigma = pair_.plan().options.normalise_window * level_.h_mm /
                             (level_.spacing_mm * glm::dvec3(level_.moment_cell));
    const int smoothed = axes(level_.moment_cells, sigma);
    steps_.push_back({"moments' window", 2.0 * kFloats * moment_cells_ * smoothed, kFramesOfPair,
                      smoothed, [this, sigma, &kernels](vulkan::Recorder& r) {
                        record_gauss(r, kernels, moment_list_, brick_groups(moment_bricks_), sigma,
                                     {&moments_[0]}, {&moments_[1]});
                      }});
  }
  steps_.push_back({"normalise", 2.0 * kScalar * voxels_ + kFloats * moment_cells_, kFramesOfPair,
                    1, [this, size, cells, cell, &kernels](vulkan::Recorder& r) {
                      r.dispatch(
                          kernels.normalise(),
                          {{raw_, kernels.nearest()}, {moments_[0], kernels.linear()}, normalised_},
                          shaders::NormalisePush{size, cells, cell, {0.01F, 1.0F, 0, 0}},
                          rows_of(level_.image_size));
                    }});
  steps_.push_back(
      {"gradient", (kScalar + kHalves) * voxels_, kFramesOfPair, 1,
       [this, size, &kernels](vulkan::Recorder& r) {
         r.dispatch(kernels.pack(false),
                    {{normalised_, kernels.nearest()}, {no_mask_, kernels.nearest()}, packed_},
                    shaders::PackPush{size, glm::vec4(level_.spacing_mm, 0)},
                    rows_of(level_.image_size));
       }});
}

void LevelSteps::add_data_term(double all, double half) {
  MotionKernels& kernels = *pair_.kernels();
  const auto record = [this, &kernels](int colour) {
    return [this, &kernels, colour](vulkan::Recorder& r) {
      const vulkan::Sampler& nearest = kernels.nearest();
      const int slices = level_.image_size.z;
      constexpr int kFar = 1 << 20;
      r.dispatch(kernels.normal_equations(level_.cell),
                 {list_,
                  {pair_.fixed().level(l_), nearest},
                  {pair_.moving().level(l_), kernels.linear()},
                  {ahead_, nearest},
                  equations_[0],
                  equations_[1],
                  equations_[2],
                  {equations_[0], nearest},
                  {equations_[1], nearest},
                  {equations_[2], nearest}},
                 shaders::NormalEquationsPush{wide(level_.cells, colour),
                                              wide(level_.image_size),
                                              wide(level_.image_size),
                                              {slices, -kFar, kFar, 0},
                                              {slices, 0, slices, 0},
                                              glm::vec4(level_.spacing_mm, 0)},
                 slice_groups(bricks_));
    };
  };
  const double of_cells = (kFloats + 3.0 * kHalves) * cells_;
  steps_.push_back(
      {"data term, every voxel", 2.0 * kHalves * voxels_ + of_cells, all, 1, record(-1)});
  // All of the moving image is read: the neighbours of a voxel's partner belong to the other half.
  if (half > 0.0) {
    steps_.push_back(
        {"data term, half the voxels", 1.5 * kHalves * voxels_ + of_cells, half, 1, record(0)});
  }
}

void LevelSteps::add_window(double calls) {
  MotionKernels& kernels = *pair_.kernels();
  const glm::dvec3 sigma = level_.options.window * level_.h_mm / level_.cell_mm;
  const int smoothed = axes(level_.cells, sigma);
  steps_.push_back({"window", 3.0 * 2.0 * kHalves * cells_ * smoothed, calls, 3 * smoothed,
                    [this, sigma, &kernels](vulkan::Recorder& r) {
                      record_gauss(r, kernels, list_, brick_groups(bricks_), sigma,
                                   {&equations_[0], &equations_[1], &equations_[2]},
                                   {&smoothed_[0], &smoothed_[1], &smoothed_[2]});
                    }});
}

void LevelSteps::add_update(double calls) {
  MotionKernels& kernels = *pair_.kernels();
  const double damping = pair_.plan().options.damping / level_.h_mm;
  const shaders::UpdatePush push{
      wide(level_.cells),
      glm::vec4(level_.cell_mm, 0),
      {float(damping * damping), float(pair_.plan().options.largest_step * level_.h_mm), 0, 0}};
  steps_.push_back({"step, composed", (3.0 * kHalves + 2.0 * kFloats) * cells_, calls, 1,
                    [this, push, &kernels](vulkan::Recorder& r) {
                      const vulkan::Sampler& nearest = kernels.nearest();
                      r.dispatch(kernels.update(),
                                 {list_,
                                  {smoothed_[0], nearest},
                                  {smoothed_[1], nearest},
                                  {smoothed_[2], nearest},
                                  {ahead_, kernels.linear()},
                                  composed_},
                                 push, slice_groups(bricks_));
                    }});
}

void LevelSteps::add_filter(double calls) {
  MotionKernels& kernels = *pair_.kernels();
  const MotionOptions& options = pair_.plan().options;
  // The time of the kernels does not depend on the weights: unit slopes are used.
  const shaders::TotalVariationPush push{
      wide(level_.cells),
      glm::vec4(1, 1, 1, 0),
      {float(level_.options.smoothness * level_.h_mm), 1.0F / 12.0F, float(options.huber_mm),
       float(options.momentum)}};
  const auto primal = [this, push, &kernels](bool last) {
    return [this, push, &kernels, last](vulkan::Recorder& r) {
      const vulkan::Sampler& nearest = kernels.nearest();
      r.dispatch(kernels.tv_primal(last),
                 {list_,
                  {composed_, nearest},
                  {dual_[0], nearest},
                  {dual_[1], nearest},
                  {dual_[2], nearest},
                  {field_, nearest},
                  last ? field_ : primal_,
                  ahead_},
                 push, slice_groups(bricks_));
    };
  };
  const double steps = calls * options.filter_steps;
  steps_.push_back({"total variation, primal", (2.0 * kFloats + 3.0 * kHalves) * cells_, steps, 1,
                    primal(false)});
  steps_.push_back({"total variation, dual", (kFloats + 6.0 * kHalves) * cells_, steps, 1,
                    [this, push, &kernels](vulkan::Recorder& r) {
                      const vulkan::Sampler& nearest = kernels.nearest();
                      r.dispatch(kernels.tv_dual(),
                                 {list_,
                                  {primal_, nearest},
                                  {dual_[0], nearest},
                                  {dual_[1], nearest},
                                  {dual_[2], nearest},
                                  dual_[0],
                                  dual_[1],
                                  dual_[2]},
                                 push, slice_groups(bricks_));
                    }});
  if (level_.options.second > 0.0) {
    const auto with_second = [this, &kernels](const vulkan::Image& read) {
      std::vector<vulkan::Binding> bindings{list_, {read, kernels.nearest()}};
      for (const vulkan::Image& q : second_) bindings.emplace_back(q, kernels.nearest());
      return bindings;
    };
    steps_.push_back({"second differences, primal", (2.0 * kFloats + 6.0 * kHalves) * cells_,
                      steps + calls, 1, [this, push, with_second, &kernels](vulkan::Recorder& r) {
                        std::vector<vulkan::Binding> bindings = with_second(composed_);
                        bindings.emplace_back(primal_);
                        r.dispatch(kernels.tv_second_primal(), bindings, push,
                                   slice_groups(bricks_));
                      }});
    steps_.push_back({"second differences, dual", (kFloats + 12.0 * kHalves) * cells_, steps, 1,
                      [this, push, with_second, &kernels](vulkan::Recorder& r) {
                        std::vector<vulkan::Binding> bindings = with_second(primal_);
                        for (const vulkan::Image& q : second_) bindings.emplace_back(q);
                        r.dispatch(kernels.tv_second_dual(), bindings, push, slice_groups(bricks_));
                      }});
  }
  steps_.push_back({"total variation, last, momentum", (4.0 * kFloats + 3.0 * kHalves) * cells_,
                    calls, 1, primal(true)});
}

void LevelSteps::add_measure(double calls) {
  MotionKernels& kernels = *pair_.kernels();
  steps_.push_back({"measure of the bricks", (kFloats + 3.0 * kHalves) * cells_, calls, 1,
                    [this, &kernels](vulkan::Recorder& r) {
                      r.dispatch(kernels.measure(),
                                 {list_,
                                  {field_, kernels.nearest()},
                                  {seen_, kernels.nearest()},
                                  seen_,
                                  {smoothed_[2], kernels.nearest()},
                                  measures_},
                                 shaders::MeasurePush{wide(level_.cells), {1.0F, 0, 0, 0}},
                                 brick_groups(bricks_));
                    }});
}

}  // namespace palpate::bench
