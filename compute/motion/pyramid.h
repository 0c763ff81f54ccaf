#pragma once

#include <memory>
#include <vector>

#include "compute/motion/intensity.h"
#include "compute/motion/kernels.h"
#include "compute/motion/plan.h"
#include "compute/motion/region.h"
#include "compute/vulkan/recorder.h"

namespace palpate {

/// One frame on the device: on every level the image and its gradient in one texel (gx gy gz I),
/// locally normalised if the plan says so. With more than one slab the finest level lives on the
/// host.
class FramePyramid {
 public:
  FramePyramid(const std::shared_ptr<vulkan::Context>& context, const MotionPlan& plan);
  const vulkan::Image& level(size_t l) const { return levels_[l]; }
  /// The finest level's scaled intensities, which the step for sliding borders compares; none if
  /// the plan has no such step.
  const vulkan::Image& raw() const { return raw_; }
  /// The floor of local normalisation that the frame was prepared with, in scaled units.
  double noise() const { return noise_; }
  /// The finest level's texels of slab s, the slices that it holds, in host memory that the device
  /// can copy from. Only with more than one slab.
  const vulkan::Buffer& slab(size_t s) const { return slabs_[s]; }
  /// Motion up to which this frame can be the moving one, in mm: it was prepared no further around
  /// what the mask leaves.
  double reach_mm() const { return reach_mm_; }

 private:
  friend class PyramidBuilder;
  std::vector<vulkan::Image> levels_;
  std::vector<vulkan::Buffer> slabs_;
  vulkan::Image raw_;  // r16f
  double reach_mm_ = 0.0;
  double noise_ = 0.0;
};

/// Fills pyramids. Owns what it needs on the way, so one builder serves all frames of a plan. One
/// thread at a time.
class PyramidBuilder {
 public:
  PyramidBuilder(std::shared_ptr<vulkan::Context> context, std::shared_ptr<MotionKernels> kernels,
                 const MotionPlan& plan, const Region& region);

  /// Uploads and computes all levels; waits for the end. `noise` is the floor of local
  /// normalisation, in scaled units. The gradients of voxels that do not count are infinite; so are
  /// those outside the region's boxes, whose intensity is 0. Throws vulkan::Failure.
  void build(const HalfVolume& volume, double noise, FramePyramid& target);

  /// Another region of the same plan, for the frames to come.
  void set_region(const Region& region);

 private:
  /// What one image needs on its way from intensities to texels.
  struct Workspace {
    Workspace(const std::shared_ptr<vulkan::Context>& context, glm::ivec3 size, glm::ivec3 cell,
              bool holds_raw);
    glm::ivec3 size{0}, cells{0};
    vulkan::Image raw;         // r16f; none on the finest level if the frames keep it
    vulkan::Image normalised;  // r16f
    vulkan::Image moments[2];  // rg32f, on cells
    // What of them is needed for the texels of a box: voxels, cells of the moments, and bricks of
    // these.
    VoxelBox packed_box, normalised_box, moments_box;
    BrickList bricks;
    vulkan::Buffer list;
  };
  void aim(Workspace& work, const LevelPlan& level, const VoxelBox& box) const;
  vulkan::Image upload_mask(const uint8_t* values, glm::ivec3 size);
  void build_slab(const HalfVolume& volume, const Slab& slab, double noise,
                  const vulkan::Buffer& target);
  void record_level(vulkan::Recorder& recorder, size_t l, const Workspace& work,
                    const vulkan::Image& raw, double noise, const vulkan::Image* mask,
                    const vulkan::Image& packed);

  std::shared_ptr<vulkan::Context> context_;
  std::shared_ptr<MotionKernels> kernels_;
  const MotionPlan plan_;
  vulkan::Buffer staging_;
  std::vector<Workspace> levels_;     // [0] is a stand-in if the finest images are cut into slabs
  std::vector<vulkan::Image> masks_;  // r8 per level, only with a mask
  std::vector<uint8_t> finest_mask_;  // for slabs, only with a mask
  double reach_mm_ = 0.0;
  vulkan::Image no_mask_;
  vulkan::Recorder recorder_;
};

}  // namespace palpate
