#pragma once

#include <memory>
#include <vector>

#include "compute/motion/intensity.h"
#include "compute/motion/kernels.h"
#include "compute/motion/plan.h"
#include "compute/vulkan/recorder.h"

namespace palpate {

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

  /// Uploads and computes all levels; waits for the end. `noise` is the floor of local
  /// normalisation, in scaled units. With `masked`, voxels outside the mask get no value on the
  /// finest level, and on a coarser one if most of what they cover is outside. Throws
  /// vulkan::Failure.
  void build(const HalfVolume& volume, double noise, bool masked, FramePyramid& target);

  /// The mask for build(): on the frames' grid.
  void set_mask(const Mask& mask);

 private:
  void record_level(vulkan::Recorder& recorder, size_t l, double noise, bool masked,
                    const vulkan::Image& packed);

  std::shared_ptr<vulkan::Context> context_;
  std::shared_ptr<MotionKernels> kernels_;
  const MotionPlan plan_;
  vulkan::Buffer staging_;
  std::vector<vulkan::Image> raw_;         // r16f per level
  std::vector<vulkan::Image> normalised_;  // r16f per level
  std::vector<vulkan::Image> masks_;       // r8 per level, only once a mask was given
  std::vector<vulkan::Image> moments_[2];  // rgba32f per level
  std::vector<vulkan::Buffer> moment_bricks_;
  vulkan::Image no_mask_;
};

}  // namespace palpate
