#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "compute/motion/pyramid.h"
#include "compute/motion/region.h"

namespace palpate {

/// The finest images of a pair where the device has no room for them: one slab of each at a time,
/// whose texels are made from what the frames keep on the host. One thread at a time.
class SlabImages {
 public:
  /// Throws vulkan::Failure.
  SlabImages(std::shared_ptr<vulkan::Context> context, std::shared_ptr<MotionKernels> kernels,
             const MotionPlan& plan, const Region& region);

  /// Most dispatches that record_pairs() records, without those of `dispatch`.
  static int most_dispatches(const MotionPlan& plan);

  /// Called with the images of a slab of the fixed frame and of one of the moving frame.
  using Dispatch = std::function<void(const vulkan::Image& fixed, const vulkan::Image& moving,
                                      const Slab& fixed_slab, const Slab& moving_slab)>;
  /// Records the pairs of slabs in which these bricks of the finest field may have corresponding
  /// voxels, at most `reach` slices apart along k: copies both, and calls `dispatch`.
  void record_pairs(vulkan::Recorder& recorder, const FramePyramid& fixed,
                    const FramePyramid& moving, const BrickList& bricks, double reach,
                    const Dispatch& dispatch) const;

 private:
  void record_texels(vulkan::Recorder& recorder, const FramePyramid& frame, size_t s,
                     const vulkan::Image& texels) const;

  std::shared_ptr<MotionKernels> kernels_;
  const MotionPlan plan_;
  const std::vector<Slab> slabs_;
  vulkan::Image fixed_, moving_;       // rgba16f: texels
  vulkan::Image normalised_;           // r16f: what they are made of
  vulkan::Image mask_;                 // r8; a placeholder without a mask
  std::vector<vulkan::Buffer> masks_;  // of each slab, on the host; empty without a mask
};

}  // namespace palpate
