#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "module/session/scene_picture.h"
#include "module/session/session.h"
#include "module/view/picture.h"

namespace palpate {

/// Pictures of a scene that is felt, on one device: the renderer, and what of the scene it has. One
/// thread at a time.
class Viewer {
 public:
  /// kDeviceFailed, kOutOfMemory.
  static Result<std::unique_ptr<Viewer>> open(std::shared_ptr<vulkan::Context> context,
                                              const ViewChoices& choices,
                                              const RendererOptions& options);
  /// On a device that it opens. kNoDevice, too.
  static Result<std::unique_ptr<Viewer>> open(const vulkan::ContextOptions& gpu,
                                              const ViewChoices& choices,
                                              const RendererOptions& options);
  /// Waits for the picture that is being drawn.
  ~Viewer();
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  /// From the next picture on.
  void choose(const ViewChoices& choices) { picture_.choose(choices); }
  /// Takes the scene as it is felt now; uploads what is new of it. Before bounds and pictures.
  Status update(std::shared_ptr<const Scene> scene);
  /// The stream tubes that the hand has released; from the next picture on.
  void show(std::shared_ptr<const ReleasedTubes> tubes) { picture_.show(std::move(tubes)); }
  /// Both, as they are in a session now.
  Status update(const Session& session);
  /// Draws `snapshot` as it will be at display_ns (monotonic) for one eye or two; submits, and does
  /// not wait. See VolumeRenderer::start(). images: of a host's, into which it goes; null: none.
  Status start(const SceneSnapshot& snapshot, int64_t display_ns, std::span<const Eye> eyes,
               PictureSize size, const HostImages* images = nullptr);
  /// Draws the same and waits: a picture per eye.
  Result<std::vector<Picture>> take(const SceneSnapshot& snapshot, int64_t display_ns,
                                    std::span<const Eye> eyes, PictureSize size);
  /// A picture for a file: at the time of its tick, from a place that sees all of the scene. eyes:
  /// 1 or 2, of a head there.
  Result<std::vector<Picture>> take_all(const SceneSnapshot& snapshot, PictureSize size, int eyes);

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

/// What a ViewerThread opens.
struct ViewerThreadOptions {
  vulkan::ContextOptions gpu;
  ViewChoices choices;
  RendererOptions renderer;
  SnapshotReader reader = SnapshotReader::kPictures;  ///< no other thread may use the same reader
};

/// Draws what is felt again and again, on a thread of low priority and a device of its own, for
/// those who show it or keep it.
class ViewerThread {
 public:
  /// Draws one picture of the newest snapshot (is_new: another than last time) or none, and says
  /// when it wants to be asked again, counted from when it was asked. On the thread. An error ends
  /// it.
  using Draw = std::function<Result<std::chrono::milliseconds>(
      Viewer& viewer, const SceneSnapshot& snapshot, bool is_new)>;

  /// Starts at once. `session` is borrowed.
  ViewerThread(Session& session, ViewerThreadOptions options, Draw draw);
  ViewerThread(const ViewerThread&) = delete;
  ViewerThread& operator=(const ViewerThread&) = delete;

  /// Ends the thread, as the destructor does, and waits for it.
  void stop();
  /// Why there are no pictures any more: a sentence, or nothing. Any thread.
  std::string trouble() const;

 private:
  void run(std::stop_token stop);
  Status draw_until(std::stop_token stop);

  Session& session_;
  ViewerThreadOptions options_;
  Draw draw_;
  mutable std::mutex mutex_;
  std::string trouble_;
  std::jthread thread_;
};

}  // namespace palpate
