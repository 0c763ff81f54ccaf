#pragma once

#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "module/view/repacker.h"
#include "module/view/resolution.h"
#include "module/view/volume_renderer.h"
#include "module/xr/picture_source.h"

namespace palpate::xr {

/// What a frame is to show.
struct Scenery {
  ViewScene scene;
  /// All volumes that the scene may show; uploaded when they change.
  std::span<const std::shared_ptr<const MovingVolume>> volumes;
  std::optional<HangingPanel> panel;
};

/// Called once per frame; none: there is nothing to show yet.
using Show = std::function<std::optional<Scenery>(const HeadsetFrame& frame)>;

/// An eye of the headset as the renderer takes it.
palpate::Eye eye_of(const EyeView& eye);

/// The same with the angles of view enlarged to the right and downwards, so that a picture of
/// `size` has the view's own picture, of `part` pixels, in its upper left corner.
palpate::Eye eye_of(const EyeView& eye, PictureSize part, PictureSize size);

/// Draws volumes into the headset: all eyes in one dispatch, colour and depth, in as many pixels
/// as there is time for. On another device all is made and uploaded anew, on a thread of its own,
/// while frames without a picture keep the runtime's loop alive. Threads and errors as
/// PictureSource says.
class VolumeSource final : public PictureSource {
 public:
  explicit VolumeSource(Show show) : show_(std::move(show)) {}

  Status use(const std::shared_ptr<vulkan::Context>& context) override;
  void drop() noexcept override;
  Result<Drawn> record(const HeadsetFrame& frame, VkCommandBuffer commands) override;
  /// The median of the first pictures, with half of the full pixels; the runtime needs a part of
  /// each period, too.
  double needed_period_s() const override { return needed_s_; }
  std::optional<HangingPanel> panel() override { return panel_; }

  /// Why the last frame that was asked for has no picture: a sentence, or nothing.
  const std::string& trouble() const { return trouble_; }
  /// Whether frames have no picture because what draws them is still being made.
  bool preparing() const { return making_.valid(); }
  /// Pixels of the largest view's last picture; of each view's, as HeadsetFrame::eyes; and what the
  /// device took for all of them.
  PictureSize size() const { return size_; }
  const std::vector<PictureSize>& sizes() const { return sizes_; }
  double picture_s() const { return picture_s_; }

 private:
  struct Drawing {
    std::unique_ptr<VolumeRenderer> renderer;
    /// None where the renderer's bytes go as they are. Goes first: it reads what the renderer has.
    std::unique_ptr<Repacker> repacker;
  };
  using DrawingResult = Result<std::unique_ptr<Drawing>>;
  /// What a renderer is made for, and the first picture that it will draw.
  struct Wanted {
    PictureSize most;
    VkFormat format;
    std::vector<std::shared_ptr<const MovingVolume>> volumes;
    ViewScene scene;
    std::vector<palpate::Eye> eyes;
    bool masked;
  };
  static DrawingResult make(const std::shared_ptr<vulkan::Context>& context, const Wanted& wanted);
  /// True once there is a renderer with the scenery's volumes, for pictures of this format.
  Result<bool> prepare(const Scenery& scenery, const HeadsetFrame& frame);
  void start_making(Wanted wanted);
  /// What of the pictures the optics let through and what their views have; null where that is all.
  std::shared_ptr<const VisiblePixels> visible_of(const HeadsetFrame& frame,
                                                  const std::vector<palpate::Eye>& eyes);
  void note_need(double update_s, double rays_s, double share);
  Drawn copy(const HeadsetFrame& frame, VkCommandBuffer commands) const;

  Show show_;
  std::shared_ptr<vulkan::Context> context_;
  std::unique_ptr<Drawing> drawing_;                          ///< none: nothing is ready
  std::future<DrawingResult> making_;                         ///< valid while a renderer is made
  PictureSize most_;                                          ///< that it is or was made for
  VkFormat format_ = VK_FORMAT_UNDEFINED;                     ///< the same
  std::vector<std::shared_ptr<const MovingVolume>> volumes_;  ///< that it has or will have
  /// As it was last asked for, and what came of it.
  struct HiddenParts {
    std::vector<HiddenMesh> hidden;
    std::vector<glm::dvec4> tangents;  ///< of views of which something is hidden, else 0
    std::vector<PictureSize> sizes;
    std::shared_ptr<const VisiblePixels> visible;
  };
  HiddenParts mask_;
  std::optional<HangingPanel> panel_;  ///< of the last frame
  Resolution resolution_;
  PictureSize size_;                ///< of the largest view
  std::vector<PictureSize> sizes_;  ///< of each view, at most size_
  double picture_s_ = 0.0;
  std::vector<double> needs_s_;  ///< of the first pictures, until there are enough
  double needed_s_ = 0.0;
  bool unmeasured_ = false;  ///< the last picture's time was not asked for yet
  std::string trouble_;
};

}  // namespace palpate::xr
