#pragma once

#include <memory>
#include <vector>

#include "compute/motion/intensity.h"
#include "compute/motion/kernels.h"
#include "compute/motion/plan.h"
#include "compute/motion/region.h"
#include "compute/vulkan/recorder.h"

namespace palpate {

/// One frame on the device: on every level an image of texels (gx gy gz I), gradient and intensity,
/// locally normalised if the plan says so. With more than one slab the finest level is kept on the
/// host.
class FramePyramid {
 public:
  FramePyramid(const std::shared_ptr<vulkan::Context>& context, const MotionPlan& plan);
  const vulkan::Image& level(size_t l) const { return levels_[l]; }
  /// The finest level's scaled intensities, for the step for sliding borders; empty if the plan
  /// does not contain it.
  const vulkan::Image& raw() const { return raw_; }
  /// The floor of local normalisation that the frame was prepared with, in scaled units.
  double noise() const { return noise_; }
  /// The finest level's normalised intensities (fp16) of the slices of slab s, in host memory that
  /// the device can copy from. Only with more than one slab.
  const vulkan::Buffer& slab(size_t s) const { return slabs_[s]; }
  /// Largest motion, in mm, for which this frame can be the moving one: with a mask only voxels up
  /// to this distance from its bricks were prepared.
  double reach_mm() const { return reach_mm_; }

 private:
  friend class PyramidBuilder;
  std::vector<vulkan::Image> levels_;
  std::vector<vulkan::Buffer> slabs_;
  vulkan::Image raw_;  // r16f
  double reach_mm_ = 0.0;
  double noise_ = 0.0;
};

/// What texels are made of: normalised intensities, and the voxels that count. Without a mask any
/// r8 image stands in its place.
struct PackInput {
  const vulkan::Image& normalised;
  const vulkan::Image* mask = nullptr;
  const vulkan::Image& no_mask;
};

/// Records the texels of a box of level l, or of a part of it along k that begins with slice
/// `first_slice` of the level (pack.comp).
void record_pack(vulkan::Recorder& recorder, MotionKernels& kernels, const MotionPlan& plan,
                 size_t l, const PackInput& from, const vulkan::Image& texels, const VoxelBox& box,
                 int first_slice);

/// Computes pyramids. Owns the intermediate images, so one builder serves all frames of a plan. One
/// thread at a time.
class PyramidBuilder {
 public:
  PyramidBuilder(std::shared_ptr<vulkan::Context> context, std::shared_ptr<MotionKernels> kernels,
                 const MotionPlan& plan, const Region& region);

  /// Uploads a frame, computes all levels and waits. `noise`: the floor of local normalisation, in
  /// scaled units. Gradients of voxels that do not count (outside of the mask, and the outermost
  /// ones of the finest level that is solved), and outside the region's boxes, are infinite;
  /// outside the boxes the intensity is 0. Throws vulkan::Failure.
  void build(const HalfVolume& volume, double noise, FramePyramid& target);

  /// Sets another region of the same plan, for the frames that follow.
  void set_region(const Region& region);

 private:
  /// Intermediate images of one level, from intensities to texels.
  struct Workspace {
    Workspace(const std::shared_ptr<vulkan::Context>& context, glm::ivec3 size, glm::ivec3 cell,
              bool holds_raw);
    glm::ivec3 size{0}, cells{0};
    vulkan::Image raw;         // r16f; none on the finest level if the frames keep it
    vulkan::Image normalised;  // r16f
    vulkan::Image moments[2];  // rg32f, on cells
    // Parts that are needed for the texels of a box: voxels, cells of the moments, bricks of these.
    VoxelBox packed_box, normalised_box, moments_box;
    BrickList bricks;
    vulkan::Buffer list;
  };
  void aim(Workspace& work, const LevelPlan& level, const VoxelBox& box) const;
  vulkan::Image upload_mask(const uint8_t* values, glm::ivec3 size);
  void build_slab(const HalfVolume& volume, const Slab& slab, double noise,
                  const vulkan::Buffer& target);
  void record_normalised(vulkan::Recorder& recorder, size_t l, const Workspace& work,
                         const vulkan::Image& raw, double noise);

  std::shared_ptr<vulkan::Context> context_;
  std::shared_ptr<MotionKernels> kernels_;
  const MotionPlan plan_;
  vulkan::Buffer staging_;
  std::vector<Workspace> levels_;     // with slabs, [0] is a placeholder
  std::vector<vulkan::Image> masks_;  // r8 per level, only with a mask
  double reach_mm_ = 0.0;
  vulkan::Image no_mask_;
  vulkan::Recorder recorder_;
};

}  // namespace palpate
