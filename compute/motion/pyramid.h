#pragma once

#include <memory>
#include <vector>

#include "compute/motion/intensity.h"
#include "compute/motion/kernels.h"
#include "compute/motion/plan.h"
#include "compute/vulkan/recorder.h"

namespace palpate {

/// One frame on the device: on every level the image and its gradient in one texel (gx gy gz I),
/// locally normalised if the plan says so. With more than one slab the finest level lives on the
/// host.
class FramePyramid {
 public:
  FramePyramid(const std::shared_ptr<vulkan::Context>& context, const MotionPlan& plan);
  const vulkan::Image& level(size_t l) const { return levels_[l]; }
  /// The finest level's texels of slab s, the slices that it holds, in host memory that the device
  /// can copy from. Only with more than one slab.
  const vulkan::Buffer& slab(size_t s) const { return slabs_[s]; }

 private:
  std::vector<vulkan::Image> levels_;
  std::vector<vulkan::Buffer> slabs_;
};

/// Fills pyramids. Owns what it needs on the way, so one builder serves all frames of a plan. One
/// thread at a time.
class PyramidBuilder {
 public:
  PyramidBuilder(std::shared_ptr<vulkan::Context> context, std::shared_ptr<MotionKernels> kernels,
                 const MotionPlan& plan);

  /// Uploads and computes all levels; waits for the end. `noise` is the floor of local
  /// normalisation, in scaled units. With `masked`, the gradients of voxels outside the mask are
  /// infinite on the finest level, and on a coarser one if most of what they cover is outside.
  /// Throws vulkan::Failure.
  void build(const HalfVolume& volume, double noise, bool masked, FramePyramid& target);

  /// The mask for build(): on the frames' grid.
  void set_mask(const Mask& mask);

 private:
  /// What one image needs on its way from intensities to texels.
  struct Workspace {
    Workspace(const std::shared_ptr<vulkan::Context>& context, glm::ivec3 size, glm::ivec3 cell);
    glm::ivec3 size{0}, cells{0};
    vulkan::Image raw;         // r16f
    vulkan::Image normalised;  // r16f
    vulkan::Image moments[2];  // rg32f, on cells
    vulkan::Buffer bricks;     // of the cells
  };
  vulkan::Image upload_mask(const uint8_t* values, glm::ivec3 size);
  void build_slab(const HalfVolume& volume, const Slab& slab, double noise, bool masked,
                  const vulkan::Buffer& target);
  void record_level(vulkan::Recorder& recorder, size_t l, const Workspace& work, double noise,
                    const vulkan::Image* mask, const vulkan::Image& packed);

  std::shared_ptr<vulkan::Context> context_;
  std::shared_ptr<MotionKernels> kernels_;
  const MotionPlan plan_;
  vulkan::Buffer staging_;
  std::vector<Workspace> levels_;     // [0] is a stand-in if the finest images are cut into slabs
  std::vector<vulkan::Image> masks_;  // r8 per level, only once a mask was given
  std::vector<uint8_t> finest_mask_;  // for slabs
  vulkan::Image no_mask_;
};

}  // namespace palpate
