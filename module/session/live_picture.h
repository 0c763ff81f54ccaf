#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "module/session/viewer.h"
#include "module/view/resolution.h"

namespace palpate {

/// What is to be seen next.
struct WantedPicture {
  Eye eye;
  PictureSize size;  ///< of the place where it is shown; drawn smaller where it would take too long
  ViewChoices choices;
};

/// A picture with what it shows.
struct LiveFrame {
  Picture picture;
  Eye eye;
  SceneSnapshot snapshot;
  double picture_s = 0.0;  ///< that drawing and reading it back took
};

/// What is felt for a window: it goes on taking the mouse while a slow device draws.
class LivePicture {
 public:
  /// Starts at once, and opens a device of its own; draws from the first want() on. `session` is
  /// borrowed, and its newest snapshot is read here alone.
  LivePicture(Session& session, const vulkan::ContextOptions& gpu);

  /// From the next picture on. Any thread.
  void want(const WantedPicture& wanted);
  /// The last that was drawn; null before the first. Any thread.
  std::shared_ptr<const LiveFrame> newest() const;
  /// Why there are no pictures any more: a sentence, or nothing. Any thread.
  std::string trouble() const { return thread_.trouble(); }

 private:
  Result<std::chrono::milliseconds> draw(Viewer& viewer, const SceneSnapshot& snapshot);

  Session& session_;
  Resolution resolution_;
  mutable std::mutex mutex_;  ///< of what follows but the thread
  WantedPicture wanted_;
  std::shared_ptr<const LiveFrame> newest_;
  ViewerThread thread_;
};

}  // namespace palpate
