#pragma once

#include <array>
#include <memory>
#include <vector>

#include "compute/motion/pyramid.h"

namespace palpate {

/// Coupled convex search over whole-voxel displacements, started from the field at the end of a
/// level. It finds motions larger than the spacing of structures, for which gradient methods
/// converge to the wrong structure (Heinrich, Papiez, Schnabel, Handels, MICCAI workshop WBIR
/// 2014). Only nodes at which that field leaves an unexplained difference are searched. One thread
/// at a time. Throws vulkan::Failure.
class DiscreteStart {
 public:
  DiscreteStart(std::shared_ptr<vulkan::Context> context, std::shared_ptr<MotionKernels> kernels,
                const MotionPlan& plan, const SearchPlan& search);

  /// Costs of the labels at the nodes, and a second buffer for smoothing them. Reused by every
  /// search.
  using Costs = std::array<vulkan::Buffer, 2>;

  /// Searches at the given nodes (indices, x fastest) and waits for the device. `current`: the
  /// field of the level on its cells, mm along the image axes. `costs` grows where needed. The
  /// result is field(), on the nodes: the displacement found, or `current` where nothing was
  /// searched. Returns the number of labels tried at each node; 0, without a result, if the budget
  /// is too small for all nodes.
  int solve(const FramePyramid& fixed, const FramePyramid& moving, const vulkan::Image& current,
            const std::vector<uint32_t>& nodes, Costs& costs);

  const SearchPlan& search() const { return search_; }
  const vulkan::Image& field() const { return choice_; }

 private:
  void record_cost(vulkan::Recorder& recorder, const FramePyramid& fixed,
                   const FramePyramid& moving, const Costs& cost, int count, glm::ivec3 reach);
  void record_rounds(vulkan::Recorder& recorder, const vulkan::Buffer& cost, int count,
                     glm::ivec3 reach);

  std::shared_ptr<vulkan::Context> context_;
  std::shared_ptr<MotionKernels> kernels_;
  const SearchPlan search_;
  const LevelPlan level_;
  vulkan::Buffer list_, places_, bricks_;
  vulkan::Image base_, choice_, smooth_, scratch_;
  vulkan::Recorder recorder_;
};

}  // namespace palpate
