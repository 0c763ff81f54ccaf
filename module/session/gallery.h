#pragma once

#include <array>
#include <mutex>
#include <string>
#include <vector>

#include "module/session/viewer.h"

namespace palpate {

struct GalleryOptions {
  vulkan::ContextOptions gpu;
  ViewChoices view;
  PictureSize size{384, 384};
  int pictures = 4;  ///< phases, evenly spread
};

/// A stereo picture, and the state of the scene at its time.
struct StereoPicture {
  std::array<Picture, 2> eyes;  ///< left, right
  SceneSnapshot snapshot;
  double frame = 0.0;  ///< of the first moving volume, with its phase
  double force_n = 0.0;
  std::vector<TubeColours> tube_colours;
};

/// Draws a scene off screen while it runs: both eyes again and again on a thread of its own, at the
/// rate of a headset. Keeps one stereo picture per phase, with contact if there was any.
class Gallery {
 public:
  /// Starts to draw once the device is open and the volumes are uploaded. `session` is borrowed.
  Gallery(Session& session, const GalleryOptions& options);

  /// Draws no further picture. Waits for the present one, but not longer than this: false if it is
  /// still being drawn. Then the gallery and the session must not be destroyed yet.
  bool stop(std::chrono::milliseconds most) { return thread_.stop_within(most); }
  /// Why there are no pictures, as a sentence; empty without an error. This and the functions below
  /// may be called at any time, on any thread.
  std::string trouble() const { return thread_.trouble(); }
  /// Number of frames drawn, and the median time for one, ms.
  size_t frames() const;
  double median_ms() const;
  double first_picture_s() const;
  /// In the order of their phases; phases without a picture are left out.
  std::vector<StereoPicture> pictures() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Kept {
    bool any = false, touching = false, moving = false;
    StereoPicture picture;
  };
  Result<std::chrono::milliseconds> draw(Viewer& viewer, const SceneSnapshot& snapshot);
  void keep(const SceneSnapshot& snapshot, const ViewScene& scene, std::vector<Picture> pictures);

  Session& session_;
  GalleryOptions options_;
  Clock::time_point begin_ = Clock::now();
  mutable std::mutex mutex_;  ///< guards what follows
  std::vector<Kept> kept_;
  std::vector<double> frame_ms_;
  double first_picture_s_ = 0.0;
  ViewerThread thread_;
};

}  // namespace palpate
