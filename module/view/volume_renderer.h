#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "compute/vulkan/buffer.h"
#include "compute/vulkan/recorder.h"
#include "module/view/eye.h"
#include "module/view/host_images.h"
#include "module/view/picture.h"
#include "module/view/view_scene.h"
#include "module/view/visible_pixels.h"

namespace palpate {

namespace view {
class Kernels;
class LightGrid;
class MeshList;
class RayLattice;
class ShownVolume;
class ThingList;
struct LookTables;
struct ResidentVolume;
struct ResidentFrames;
}  // namespace view

/// What can be chosen once, for measurements mostly.
struct RendererOptions {
  PictureSize most{512, 512};  ///< largest picture of an eye
  int most_eyes = 2;
  /// Along rays, of the finest axis. Slopes are differences over two voxels, so two samples see a
  /// change anywhere between them up to a distance of two voxels.
  double samples_per_voxel = 0.5;
  /// Four times as many samples where the light changes, as at surfaces. Off: less work for smooth
  /// looks.
  bool refines = true;
  /// Rays are drawn for every second pixel along both axes first. The pixels between are
  /// interpolated where the picture is smooth: where |a - 2 b + c| of three rays a, b, c in a row
  /// is below this, in colour (sRGB) and transmittance, both 0 to 1, and in 1 / depth as a share of
  /// b's. Elsewhere their rays are drawn, too. 0: rays of all pixels; infinity: none for the sake
  /// of smoothness. Where voxels are smaller than pixels an eye has rays of all pixels.
  double smooth = 16.0 / 255.0;
  double near_m = 0.02;        ///< nothing is drawn closer to an eye
  bool skip_empty = true;      ///< off: every sample is taken
  bool count_samples = false;  ///< statistics() then has samples
};

struct ViewStatistics {
  uint64_t samples_taken = 0;   ///< of the last picture, if they are counted
  uint64_t samples_needed = 0;  ///< those with extinction where more than 1 % of the light is left
  uint32_t frozen_nodes = 0;    ///< of the last change of phase: places where back-tracking failed
  int light_made = 0;           ///< so far, how often ambient occlusion and shadows were computed,
  int light_turned = 0;         ///< and of these how often because only the light had turned
};

/// Draws volumes and things for one to four eyes, by compute alone. Everything but set_volumes runs
/// in the frame loop. One thread at a time. Errors: kDeviceFailed, kOutOfMemory; kBadInput in a
/// sentence for scenes that can not be drawn.
///
///   auto renderer = VolumeRenderer::make(context, {});
///   (*renderer)->set_volumes(volumes);
///   (*renderer)->start(scene, eyes, size);   // records and submits; does not wait
///   ... commands submitted to the same queue from here on may copy colour() and depth() ...
///   (*renderer)->wait();
///
/// colour() and depth() hold the eyes one after the other, rows tight, 4 bytes a pixel: copy them
/// to an image by vkCmdCopyBufferToImage (RGBA8 UNORM or SRGB: the bytes are encoded already; D32
/// for depth, reversed and infinitely far: 1 at near_m, 0 at infinity), bufferOffset = eye * width
/// * height * 4, after a barrier from COMPUTE_SHADER / SHADER_WRITE to TRANSFER / TRANSFER_READ.
class VolumeRenderer {
 public:
  static Result<std::unique_ptr<VolumeRenderer>> make(std::shared_ptr<vulkan::Context> context,
                                                      const RendererOptions& options = {});
  ~VolumeRenderer();

  /// Uploads what is new and forgets what is not given any more; frames and fields that were given
  /// before are kept, so a volume that got fields is cheap. At most 4, and with segments 8: later
  /// ones of these are left out. Off the frame loop: takes tens of ms per frame of data. Waits for
  /// the picture in the making.
  Status set_volumes(std::span<const std::shared_ptr<const MovingVolume>> volumes);

  /// Draws small pictures of the scene and waits for them: the kernels that it takes are compiled
  /// then, which takes a second on some CPU drivers, and its volumes are at its phase. Off the
  /// frame loop. masked: for pictures of which not all is seen.
  Status prepare(const ViewScene& scene, std::span<const Eye> eyes, bool masked);

  /// Submits the passes that phases and looks need, and one dispatch for all eyes. Waits for the
  /// picture before. size and eyes at most those of the options. seen: of these eyes and this
  /// size, or none where all is seen, which costs nothing; the same object is uploaded once.
  Status start(const ViewScene& scene, std::span<const Eye> eyes, PictureSize size,
               std::shared_ptr<const VisiblePixels> visible = nullptr);
  /// The same into a host's images: what the host has drawn takes the place of the background, and
  /// ends rays. On the queue after what the host has submitted, before what it submits next.
  Status start(const ViewScene& scene, std::span<const Eye> eyes, PictureSize size,
               const HostImages& images);
  Status wait();

  const vulkan::Buffer& colour() const { return colour_; }
  const vulkan::Buffer& depth() const { return depth_; }
  /// The last picture of an eye, after wait().
  Result<Picture> read_back(int eye);
  ViewStatistics statistics();
  /// Seconds that the device spent on the last picture: bringing volumes to their phase, and rays.
  struct Times {
    double update_s = 0.0, rays_s = 0.0;
  };
  Times times();

 private:
  VolumeRenderer(std::shared_ptr<vulkan::Context> context, const RendererOptions& options);
  void upload(std::span<const std::shared_ptr<const MovingVolume>> volumes);
  Status start(const ViewScene& scene, std::span<const Eye> eyes, PictureSize size,
               std::shared_ptr<const VisiblePixels> visible, const HostImages* images);
  void record(const ViewScene& scene, std::span<const Eye> eyes, PictureSize size,
              const HostImages* images);
  void upload_visible();
  void upload_steps(view::ResidentVolume& resident, const view::ResidentVolume* before);
  double thin_per_mm(const view::ResidentVolume& resident) const;
  bool set_table(int slot, const Look& look);
  view::ShownVolume* shown_of(const ViewVolume& volume);
  std::vector<ViewVolume> with_segments(const ViewScene& scene) const;

  std::shared_ptr<vulkan::Context> context_;
  RendererOptions options_;
  std::unique_ptr<view::Kernels> kernels_;
  std::unique_ptr<view::ThingList> things_;
  std::unique_ptr<view::MeshList> meshes_;
  std::unique_ptr<view::LightGrid> light_;
  std::unique_ptr<view::RayLattice> lattice_;  ///< null if rays of all pixels are drawn
  bool light_is_old_ = true;                   ///< phases or looks have changed since it was made
  std::vector<std::shared_ptr<const view::ResidentVolume>> residents_;
  /// A segment as a volume of its own: its signed distance, moved as the volume's values are.
  struct SegmentVolume {
    std::shared_ptr<const MovingVolume> of;  ///< the volume that it is a segment of
    size_t segment = 0;
    std::shared_ptr<const MovingVolume> data;
  };
  std::vector<SegmentVolume> segments_;
  std::vector<std::unique_ptr<view::ShownVolume>> shown_;
  std::vector<Look> looks_;  ///< by slot, as in the tables
  std::unique_ptr<view::LookTables> tables_, staged_tables_;
  vulkan::TexelView colour_texels_, skip_texels_;
  vulkan::Buffer parameters_, skip_, thing_depth_, thing_colour_, colour_, depth_, samples_;
  std::shared_ptr<const VisiblePixels> visible_, uploaded_visible_;
  vulkan::Buffer visible_tiles_, staged_visible_;  ///< made when first needed
  vulkan::Buffer backdrop_;                        ///< likewise
  std::unique_ptr<vulkan::Recorder> recorder_;
  PictureSize size_;
  int eyes_ = 0;
  bool counted_ = false;
};

}  // namespace palpate
