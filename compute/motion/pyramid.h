#pragma once

#include <memory>
#include <vector>

#include "compute/motion/kernels.h"
#include "compute/motion/plan.h"
#include "compute/vulkan/recorder.h"

namespace palpate {

/// How raw intensities become numbers of order one: (I - offset) * scale. One for all frames of a
/// sequence, so that a difference between frames stays one.
struct IntensityScale {
  float offset = 0.0F;
  float scale = 1.0F;
};

/// Scales the range from the 1st to the 99th percentile to 1. Samples at most a few 100,000 voxels.
IntensityScale intensity_scale(const Volume& volume);

/// One frame on the device: on every level the image and its gradient in one texel (gx gy gz I),
/// locally normalised if the plan says so.
class FramePyramid {
 public:
  FramePyramid(const std::shared_ptr<vulkan::Context>& context, const MotionPlan& plan);
  const vulkan::Image& level(size_t l) const { return levels_[l]; }

 private:
  std::vector<vulkan::Image> levels_;
};

/// Fills pyramids. Owns what it needs on the way, so one builder serves all frames of a plan. One
/// thread at a time.
class PyramidBuilder {
 public:
  PyramidBuilder(std::shared_ptr<vulkan::Context> context, std::shared_ptr<MotionKernels> kernels,
                 const MotionPlan& plan);

  /// Uploads and computes all levels; waits for the end. `mask` (of the fixed frame, same grid) may
  /// be null: voxels outside get no value on the finest level and on a coarser one if most of what
  /// they cover is outside. Throws vulkan::Failure.
  void build(const Volume& volume, const IntensityScale& scale, const Mask* mask,
             FramePyramid& target);

 private:
  void upload(const Volume& volume, const IntensityScale& scale);
  void upload_mask(const Mask& mask);
  void record_level(vulkan::Recorder& recorder, size_t l, bool masked, const vulkan::Image& packed);

  std::shared_ptr<vulkan::Context> context_;
  std::shared_ptr<MotionKernels> kernels_;
  const MotionPlan plan_;
  vulkan::Buffer staging_;
  std::vector<vulkan::Image> raw_;         // r16f per level
  std::vector<vulkan::Image> normalised_;  // r16f per level
  std::vector<vulkan::Image> masks_;       // r8 per level, only once a mask was given
  vulkan::Buffer mask_staging_;
  std::vector<vulkan::Image> moments_[2];  // rgba32f per level
  std::vector<vulkan::Buffer> moment_bricks_;
  vulkan::Image no_mask_;
};

}  // namespace palpate
