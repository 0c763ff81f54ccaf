#pragma once

#include <memory>

#include "compute/motion/pyramid.h"

namespace palpate {

/// Coupled convex search over whole-voxel displacements: a start for motions larger than the
/// spacing of structures, where every gradient method takes the wrong one (Heinrich, Papiez,
/// Schnabel, Handels, MICCAI workshop WBIR 2014). One thread at a time. Throws vulkan::Failure.
class DiscreteStart {
 public:
  DiscreteStart(std::shared_ptr<vulkan::Context> context, std::shared_ptr<MotionKernels> kernels,
                const MotionPlan& plan, const SearchPlan& search);

  /// Searches and waits. The result is field(), in mm along the image axes on the nodes.
  void solve(const FramePyramid& fixed, const FramePyramid& moving);

  const SearchPlan& search() const { return search_; }
  const vulkan::Image& field() const { return *result_; }

 private:
  void record_cost(vulkan::Recorder& recorder, const FramePyramid& fixed,
                   const FramePyramid& moving);
  void record_rounds(vulkan::Recorder& recorder);

  std::shared_ptr<vulkan::Context> context_;
  std::shared_ptr<MotionKernels> kernels_;
  const SearchPlan search_;
  const glm::dvec3 spacing_mm_;
  const glm::ivec3 image_size_;
  vulkan::Buffer cost_[2];
  vulkan::Buffer bricks_;
  vulkan::Image choice_, smooth_;
  const vulkan::Image* result_ = nullptr;
};

}  // namespace palpate
