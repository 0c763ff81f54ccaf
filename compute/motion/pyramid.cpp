#include "compute/motion/pyramid.h"

#include <algorithm>
#include <cassert>

#include "compute/motion/bricks.h"
#include "compute/motion/gauss.h"

namespace palpate {
namespace {

constexpr size_t kScaleSamples = 300000;
// Box of radius 3 h, as found by experiment, has the SD of a Gaussian of 2 h.
constexpr double kMomentsSigma = 2.0;
constexpr float kLargestScaled =
    60.0F;  // beyond: a metal artefact or a broken file; keeps fp16 sums finite

glm::ivec3 groups_of(glm::ivec3 size, int local_x = 64) {
  return {(size.x + local_x - 1) / local_x, size.y, size.z};
}

/// Most of what a coarse voxel covers decides whether it is inside.
std::vector<uint8_t> shrunk_mask(const std::vector<uint8_t>& fine, glm::ivec3 fine_size,
                                 glm::ivec3 ratio, glm::ivec3 size) {
  std::vector<uint8_t> coarse(size_t(size.x) * size_t(size.y) * size_t(size.z));
  size_t out = 0;
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x, ++out) {
        int inside = 0, all = 0;
        for (int k = 0; k < ratio.x * ratio.y * ratio.z; ++k) {
          const glm::ivec3 i =
              glm::ivec3(x, y, z) * ratio +
              glm::ivec3(k % ratio.x, k / ratio.x % ratio.y, k / (ratio.x * ratio.y));
          if (i.x >= fine_size.x || i.y >= fine_size.y || i.z >= fine_size.z) continue;
          ++all;
          inside += fine[size_t(i.x) + size_t(fine_size.x) *
                                           (size_t(i.y) + size_t(fine_size.y) * size_t(i.z))] != 0;
        }
        coarse[out] = 2 * inside >= all ? 255 : 0;
      }
    }
  }
  return coarse;
}

}  // namespace

FramePyramid::FramePyramid(const std::shared_ptr<vulkan::Context>& context,
                           const MotionPlan& plan) {
  vulkan::Recorder recorder(context);
  for (size_t l = 0; l < plan.levels.size(); ++l) {
    // Levels finer than the finest one solved on need no image: a stand-in keeps indices equal.
    const bool used = int(l) >= plan.options.finest_level;
    levels_.emplace_back(context, used ? plan.levels[l].image_size : glm::ivec3(1),
                         VK_FORMAT_R16G16B16A16_SFLOAT);
    recorder.prepare(levels_.back());
  }
  recorder.run();
}

PyramidBuilder::PyramidBuilder(std::shared_ptr<vulkan::Context> context,
                               std::shared_ptr<MotionKernels> kernels, const MotionPlan& plan)
    : context_(std::move(context)),
      kernels_(std::move(kernels)),
      plan_(plan),
      staging_(context_, plan.image.count() * sizeof(uint16_t), vulkan::Buffer::Kind::kHostVisible),
      no_mask_(context_, glm::ivec3(1), VK_FORMAT_R8_UNORM) {
  vulkan::Recorder recorder(context_);
  recorder.prepare(no_mask_);
  for (const LevelPlan& level : plan_.levels) {
    raw_.emplace_back(context_, level.image_size, VK_FORMAT_R16_SFLOAT);
    normalised_.emplace_back(context_, level.image_size, VK_FORMAT_R16_SFLOAT);
    recorder.prepare(raw_.back());
    recorder.prepare(normalised_.back());
    for (auto& side : moments_) {
      side.emplace_back(context_, level.moment_cells, VK_FORMAT_R32G32B32A32_SFLOAT);
      recorder.prepare(side.back());
    }
    moment_bricks_.push_back(upload_bricks(context_, all_bricks(level.moment_cells)));
  }
  recorder.run();
}

void PyramidBuilder::set_mask(const Mask& mask) {
  assert(mask.grid.size == plan_.image.size && "the mask must have the plan's size");
  std::vector<uint8_t> values = mask.values;
  for (uint8_t& value : values) value = value ? 255 : 0;
  for (size_t l = 0; l < plan_.levels.size(); ++l) {
    const LevelPlan& level = plan_.levels[l];
    if (l > 0)
      values = shrunk_mask(values, plan_.levels[l - 1].image_size, level.ratio, level.image_size);
    if (masks_.size() <= l) masks_.emplace_back(context_, level.image_size, VK_FORMAT_R8_UNORM);
    vulkan::Buffer staging(context_, values.size(), vulkan::Buffer::Kind::kHostVisible);
    std::copy(values.begin(), values.end(), staging.as<uint8_t>().begin());
    vulkan::Recorder recorder(context_);
    recorder.prepare(masks_[l]);
    recorder.copy(staging, masks_[l]);
    recorder.run();
  }
}

void PyramidBuilder::record_level(vulkan::Recorder& recorder, size_t l, double noise, bool masked,
                                  const vulkan::Image& packed) {
  const LevelPlan& level = plan_.levels[l];
  const glm::ivec4 size(level.image_size, 0);
  const glm::ivec4 cells(level.moment_cells, 0);
  const glm::ivec4 cell(level.moment_cell, 0);
  const vulkan::Image* moments = &moments_[0][l];
  if (plan_.options.normalise) {
    recorder.dispatch(kernels_->moments(), {{raw_[l], kernels_->nearest()}, moments_[0][l]},
                      shaders::MomentsPush{size, cells, cell}, groups_of(level.moment_cells));
    const glm::dvec3 sigma = plan_.options.normalise_window * level.h_mm /
                             (level.spacing_mm * glm::dvec3(level.moment_cell));
    const glm::ivec3 groups = brick_groups(all_bricks(level.moment_cells));
    if (record_gauss(recorder, *kernels_, moment_bricks_[l], groups, sigma, {&moments_[0][l]},
                     {&moments_[1][l]})) {
      moments = &moments_[1][l];
    }
  }
  recorder.dispatch(
      kernels_->normalise(masked),
      {{raw_[l], kernels_->nearest()},
       {*moments, kernels_->linear()},
       {masked ? masks_[l] : no_mask_, kernels_->nearest()},
       normalised_[l]},
      shaders::NormalisePush{
          size, cells, cell, {float(noise * noise), plan_.options.normalise ? 1.0F : 0.0F, 0, 0}},
      groups_of(level.image_size));
  recorder.dispatch(kernels_->pack(), {{normalised_[l], kernels_->nearest()}, packed},
                    shaders::PackPush{size, glm::vec4(level.spacing_mm, 0)},
                    groups_of(level.image_size));
}

void PyramidBuilder::build(const HalfVolume& volume, double noise, bool masked,
                           FramePyramid& target) {
  assert(volume.bits.size() == plan_.image.count() && "the frame must have the plan's size");
  assert((!masked || !masks_.empty()) && "set_mask() first");
  std::copy(volume.bits.begin(), volume.bits.end(), staging_.as<uint16_t>().begin());
  vulkan::Recorder recorder(context_, uint32_t(16 * plan_.levels.size()));
  recorder.copy(staging_, raw_[0]);
  for (size_t l = 0; l < plan_.levels.size(); ++l) {
    const LevelPlan& level = plan_.levels[l];
    if (l > 0) {
      recorder.dispatch(
          kernels_->downsample(), {{raw_[l - 1], kernels_->linear()}, raw_[l]},
          shaders::DownsamplePush{glm::ivec4(plan_.levels[l - 1].image_size, 0),
                                  glm::ivec4(level.image_size, 0), glm::ivec4(level.ratio, 0)},
          groups_of(level.image_size));
    }
    if (int(l) >= plan_.options.finest_level)
      record_level(recorder, l, noise, masked, target.level(l));
  }
  recorder.run();
}

}  // namespace palpate
