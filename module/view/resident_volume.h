#pragma once

#include <memory>
#include <vector>

#include "compute/vulkan/buffer.h"
#include "compute/vulkan/image.h"
#include "module/scene/moving_volume.h"
#include "module/view/kernels.h"

namespace palpate::view {

/// A motion field on the device: u in voxels of the frames.
struct ResidentField {
  vulkan::Image image;
  glm::ivec3 size{0};
  glm::dmat3 from_voxel{1.0};  ///< field index = from_voxel * voxel + offset
  glm::dvec3 offset{0.0};
};

/// One motion for a whole sequence on the device: its terms one after the other, each a field of u
/// in voxels of the frame.
struct ResidentTerms {
  vulkan::Buffer terms;
  vulkan::TexelView texels;
  ResidentField place;  ///< without an image: that of a time is made by who draws it
};

/// The way from a frame to the next one: how it moves, and bounds of what each part of 4 x 4 x 4
/// cells shows on it (PartRange), by which bricks are left out.
struct ResidentStep {
  std::shared_ptr<const ResidentField> field;  ///< null where the data stand still
  vulkan::Buffer parts;
};

/// Frames of one volume on the device: at each voxel what the hand reads there, as a share of the
/// range of all frames. Shared by volumes that share frames.
struct ResidentFrames {
  GridPlace place;  ///< of the first frame; the others are brought onto it
  glm::dvec3 spacing_mm{1.0};
  double lowest = 0.0, highest = 1.0;
  /// One image, with slopes, to be read as shaders/view/curve.comp says: of a volume that one
  /// motion carries at all times, on a CPU. A GPU's texture unit weighs corners in 256 steps, and
  /// its half floats hold no slope times place: there values lie alone, as of all other volumes.
  bool curved = false;
  std::vector<vulkan::Image> images;
  std::vector<std::shared_ptr<const FrameData>> sources;
};

/// A volume as it lies on the device, made off the frame loop.
struct ResidentVolume {
  std::shared_ptr<const MovingVolume> source;
  std::shared_ptr<const ResidentFrames> frames;
  /// By motion, then by frame; the first motion's stand for data without motions, which have one.
  std::vector<std::vector<std::shared_ptr<const ResidentStep>>> steps;
  /// Null where there is no motion for the whole sequence.
  std::shared_ptr<const ResidentTerms> whole;
};

/// Uploads frames; those not sampled (formulas, vectors) are sampled as their detail asks, at most
/// 256 along an axis. Throws Failure.
std::shared_ptr<const ResidentFrames> upload_frames(const std::shared_ptr<vulkan::Context>& context,
                                                    Kernels& kernels, const MovingVolume& volume);

/// Uploads one step of a motion. The last step of a cycle gets what closes the cycle added, as the
/// hand adds it (module/scene/cycle_closing.h). Throws Failure.
std::shared_ptr<const ResidentField> upload_field(const std::shared_ptr<vulkan::Context>& context,
                                                  const ResidentFrames& frames,
                                                  const MovingVolume& volume, size_t motion,
                                                  size_t step);

/// Uploads the motion of a whole sequence. Throws Failure.
std::shared_ptr<const ResidentTerms> upload_terms(const std::shared_ptr<vulkan::Context>& context,
                                                  const ResidentFrames& frames,
                                                  const SequenceMap& map);

/// Bounds the way from `frame` to `next`. Throws Failure.
std::shared_ptr<const ResidentStep> bound_step(const std::shared_ptr<vulkan::Context>& context,
                                               Kernels& kernels, const ResidentFrames& frames,
                                               int frame, int next,
                                               std::shared_ptr<const ResidentField> field);

/// The rows that take a voxel to an index of the field, as the kernels want them.
void set_rows(const ResidentField& field, glm::vec4 (&rows)[3]);

/// The frame after this one: the first again in a cycle, itself at an end.
int next_frame(const MovingVolume& volume, int frame);

}  // namespace palpate::view
