#pragma once

#include <memory>
#include <span>

#include "module/session/scene_picture.h"

namespace palpate {

/// Pictures of a scene that is felt, on one device: the renderer, and what of the scene it has. One
/// thread at a time.
class Viewer {
 public:
  /// kDeviceFailed, kOutOfMemory.
  static Result<std::unique_ptr<Viewer>> open(std::shared_ptr<vulkan::Context> context,
                                              const ViewChoices& choices,
                                              const RendererOptions& options);
  /// Waits for the picture in the making.
  ~Viewer();
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  /// From the next picture on.
  void choose(const ViewChoices& choices) { picture_.choose(choices); }
  /// Takes the scene as it is felt now; uploads what is new of it. Before bounds and pictures.
  Status update(std::shared_ptr<const Scene> scene);
  /// The stream tubes that the hand has released; from the next picture on.
  void show(std::shared_ptr<const ReleasedTubes> tubes) { picture_.show(std::move(tubes)); }
  /// Draws `moment` as it will be at display_ns (monotonic) for one eye or two; submits, and does
  /// not wait. See VolumeRenderer::start(). images: of a host's, into which it goes; null: none.
  Status start(const SceneMoment& moment, int64_t display_ns, std::span<const Eye> eyes,
               PictureSize size, const HostImages* images = nullptr);

  /// What the last picture shows.
  const ViewScene& shown() const { return shown_; }
  const ScenePicture& picture() const { return picture_; }
  VolumeRenderer& renderer() { return *renderer_; }

 private:
  explicit Viewer(const ViewChoices& choices) : picture_(choices) {}
  std::unique_ptr<VolumeRenderer> renderer_;
  ScenePicture picture_;
  ViewScene shown_;
};

}  // namespace palpate
