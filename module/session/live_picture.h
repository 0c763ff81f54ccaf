#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "module/session/viewer.h"
#include "module/view/picture_mean.h"
#include "module/view/resolution.h"

namespace palpate {

/// The next picture to draw.
struct WantedPicture {
  Eye eye;
  PictureSize size;         ///< of an eye; drawn smaller if drawing would take too long
  double distance_m = 0.5;  ///< of what the eye looks at: for two eyes
  ViewChoices choices;
};

/// A picture, and what it shows.
struct LiveFrame {
  /// Of both eyes where two are asked for; not null. The mean of `averaged` pictures: while nothing
  /// in it moves, larger ones are drawn and their mean is taken, then none any more.
  std::shared_ptr<const Picture> picture;
  int averaged = 1;
  Eye eye;  ///< between both
  SceneSnapshot snapshot;
  std::vector<TubeColours> tube_colours;
  double picture_s = 0.0;  ///< time for drawing and reading back the last one of them
};

/// Pictures of a running scene for a window, drawn on another thread so that the window handles the
/// mouse while a slow device draws.
class LivePicture {
 public:
  /// Starts at once and opens its own device; draws from the first want() on. `session` is
  /// borrowed; no other object may read its snapshots as SnapshotReader::kWindow. eyes: 2 where
  /// choices of stereo other than kMono will be asked for.
  LivePicture(Session& session, const vulkan::ContextOptions& gpu, int eyes = 1);

  /// Takes effect with the next picture. Any thread.
  void want(const WantedPicture& wanted);
  /// The last picture drawn; null before the first. Any thread.
  std::shared_ptr<const LiveFrame> newest() const;
  /// Why there are no more pictures, as a sentence; empty without an error. Any thread.
  std::string trouble() const { return thread_.trouble(); }

 private:
  Result<std::chrono::milliseconds> draw(Viewer& viewer, const SceneSnapshot& snapshot);
  /// What was drawn last.
  struct LastDrawn {
    ViewScene scene;
    std::array<Eye, 2> eyes;
    PictureSize wanted;
    Stereo stereo = Stereo::kMono;
    bool operator==(const LastDrawn&) const = default;
  };

  Session& session_;
  Resolution resolution_;
  std::optional<LastDrawn> drawn_;
  std::array<PictureMean, 2> means_;
  double mean_scale_ = 0.0;   ///< of the pictures in them
  double full_s_ = 0.0;       ///< what the last picture would have taken in full size
  mutable std::mutex mutex_;  ///< of what follows but the thread
  WantedPicture wanted_;
  std::shared_ptr<const LiveFrame> newest_;
  ViewerThread thread_;
};

}  // namespace palpate
