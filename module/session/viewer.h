#pragma once

#include <chrono>
#include <condition_variable>
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

/// Draws pictures of a running scene on one device: the renderer, with the volumes that it has
/// uploaded. One thread at a time.
class Viewer {
 public:
  /// Errors: kDeviceFailed, kOutOfMemory.
  static Result<std::unique_ptr<Viewer>> open(std::shared_ptr<vulkan::Context> context,
                                              const ViewChoices& choices,
                                              const RendererOptions& options);
  /// The same on a device that it opens. Errors: also kNoDevice.
  static Result<std::unique_ptr<Viewer>> open(const vulkan::ContextOptions& gpu,
                                              const ViewChoices& choices,
                                              const RendererOptions& options);
  /// Waits for the picture that is being drawn.
  ~Viewer();
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  /// Takes effect with the next picture.
  void choose(const ViewChoices& choices) { picture_.choose(choices); }
  /// Takes the present scene and uploads what has changed. Call it before bounds and pictures.
  Status update(std::shared_ptr<const Scene> scene);
  /// The stream tubes that the user has released; from the next picture on.
  void show(std::shared_ptr<const ReleasedTubes> tubes) { picture_.show(std::move(tubes)); }
  /// Takes the scene and the stream tubes of a session.
  Status update(const Session& session);
  /// Draws `snapshot` extrapolated to display_ns (monotonic) for one or two eyes; submits without
  /// waiting. See VolumeRenderer::start(). images: a host's images to draw into; null: none.
  Status start(const SceneSnapshot& snapshot, int64_t display_ns, std::span<const Eye> eyes,
               PictureSize size, const HostImages* images = nullptr);
  /// What start() would draw.
  ViewScene scene_at(const SceneSnapshot& snapshot, int64_t display_ns, std::span<const Eye> eyes) {
    return picture_.at(snapshot, display_ns, eyes);
  }
  /// Draws one of the pictures of a scene whose mean is taken (ray_place()), and waits; returns a
  /// picture per eye.
  Result<std::vector<Picture>> take_one_of(const ViewScene& scene, int n, std::span<const Eye> eyes,
                                           PictureSize size);
  /// Draws the mean of as many pictures as ViewChoices::averaged says and waits; returns a picture
  /// per eye.
  Result<std::vector<Picture>> take(const SceneSnapshot& snapshot, int64_t display_ns,
                                    std::span<const Eye> eyes, PictureSize size);
  /// A picture for a file: at the time of its tick, from a place where the whole scene is visible.
  /// eyes: 1, or 2 of a head at that place.
  Result<std::vector<Picture>> take_all(const SceneSnapshot& snapshot, PictureSize size, int eyes);

  /// The scene of the last picture.
  const ViewScene& shown() const { return shown_; }
  const ScenePicture& picture() const { return picture_; }
  VolumeRenderer& renderer() { return *renderer_; }

 private:
  explicit Viewer(const ViewChoices& choices) : picture_(choices) {}
  std::unique_ptr<VolumeRenderer> renderer_;
  ScenePicture picture_;
  ViewScene shown_;
};

/// Options of a ViewerThread.
struct ViewerThreadOptions {
  vulkan::ContextOptions gpu;
  ViewChoices choices;
  RendererOptions renderer;
  SnapshotReader reader = SnapshotReader::kPictures;  ///< no other thread may use the same reader
};

/// Draws the running scene again and again, on a thread of low priority and with its own device,
/// for windows and files.
class ViewerThread {
 public:
  /// Draws at most one picture of the newest snapshot (is_new: another one than last time) and
  /// returns the time from the start of this call to the next one. Called on the thread. An error
  /// ends the thread.
  using Draw = std::function<Result<std::chrono::milliseconds>(
      Viewer& viewer, const SceneSnapshot& snapshot, bool is_new)>;

  /// Starts at once. `session` is borrowed.
  ViewerThread(Session& session, ViewerThreadOptions options, Draw draw);
  ViewerThread(const ViewerThread&) = delete;
  ViewerThread& operator=(const ViewerThread&) = delete;

  /// Ends the thread, as the destructor does, and waits for it.
  void stop();
  /// The same, but waits at most so long for the picture that is being drawn. False: it is still
  /// being drawn, and the session must not be destroyed yet.
  bool stop_within(std::chrono::milliseconds most);
  /// Why there are no more pictures, as a sentence; empty without an error. Any thread.
  std::string trouble() const;

 private:
  void run(std::stop_token stop);
  Status draw_until(std::stop_token stop);

  Session& session_;
  ViewerThreadOptions options_;
  Draw draw_;
  mutable std::mutex mutex_;
  std::condition_variable ended_;
  bool has_ended_ = false;
  std::string trouble_;
  std::jthread thread_;
};

}  // namespace palpate
