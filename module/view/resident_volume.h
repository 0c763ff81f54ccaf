#pragma once

#include <memory>
#include <span>
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
  ResidentField place;  ///< without an image: ShownVolume makes that of a time
};

/// The step from a frame to the next one: how it moves, and bounds of the values that each part of
/// 4 x 4 x 4 cells has during it (PartRange), by which bricks are skipped.
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
  /// One image, with slopes, to be read as shaders/view/curve.comp says: used for a volume that one
  /// motion carries at all times, on a CPU. A GPU's texture unit has only 256 steps of weight
  /// between corners, and half floats are too coarse for slopes; there, and for all other volumes,
  /// the image has values alone.
  bool curved = false;
  std::vector<vulkan::Image> images;
  std::vector<std::shared_ptr<const FrameData>> sources;
};

/// A volume as it lies on the device, made off the frame loop.
struct ResidentVolume {
  std::shared_ptr<const MovingVolume> source;
  std::shared_ptr<const ResidentFrames> frames;
  /// By motion, then by frame. Data without a motion have one entry for it, the first.
  std::vector<std::vector<std::shared_ptr<const ResidentStep>>> steps;
  /// Null where there is no motion for the whole sequence.
  std::shared_ptr<const ResidentTerms> whole;
  /// Of MovingVolume::whole_before, where it was shown before; else null.
  std::shared_ptr<const ResidentTerms> whole_before;
};

/// Frames of a volume on the host, before they are uploaded.
struct HostFrames {
  struct Frame {
    std::span<const float> values;  ///< shape (nz, ny, nx) of the place; samples or `read`
    std::vector<float> read;        ///< where the frame has no samples at the place
    /// At a voxel the hand reads (1 - 2 s) of its value and s of each neighbour's along each axis,
    /// s = smoothed: the spline's weights for samples. s = side corrects in advance part of what
    /// trilinear reading adds.
    double smoothed = 0.0, side = 0.0;
  };
  GridPlace place;  ///< of the first frame; the others are brought onto it
  glm::dvec3 spacing_mm{1.0};
  double lowest = 0.0, highest = 1.0;  ///< of all frames
  std::vector<Frame> frames;           ///< borrow the volume's samples
};

/// Reads the frames; those not sampled (formulas, vectors) at their detail_m(), with at most 256
/// samples along an axis. Uses all cores.
HostFrames host_frames(const MovingVolume& volume);

/// Uploads the frames of host_frames(). Throws as vulkan::Buffer does.
std::shared_ptr<const ResidentFrames> upload_frames(const std::shared_ptr<vulkan::Context>& context,
                                                    Kernels& kernels, const MovingVolume& volume);

/// Uploads one step of a motion. The closing of a cycle is added to its last step, as it is for the
/// hand (module/scene/cycle_closing.h). Throws as vulkan::Buffer does.
std::shared_ptr<const ResidentField> upload_field(const std::shared_ptr<vulkan::Context>& context,
                                                  const ResidentFrames& frames,
                                                  const MovingVolume& volume, size_t motion,
                                                  size_t step);

/// Uploads the motion of a whole sequence. Throws as vulkan::Buffer does.
std::shared_ptr<const ResidentTerms> upload_terms(const std::shared_ptr<vulkan::Context>& context,
                                                  const ResidentFrames& frames,
                                                  const SequenceMap& map);

/// Bounds the values during the step from `frame` to `next`. Throws as vulkan::Buffer does.
std::shared_ptr<const ResidentStep> bound_step(const std::shared_ptr<vulkan::Context>& context,
                                               Kernels& kernels, const ResidentFrames& frames,
                                               int frame, int next,
                                               std::shared_ptr<const ResidentField> field);

/// The rows that take a voxel to an index of the field, as the kernels take them.
void set_rows(const ResidentField& field, glm::vec4 (&rows)[3]);

/// The frame after this one: the first again in a cycle, itself at an end.
int next_frame(const MovingVolume& volume, int frame);

}  // namespace palpate::view
