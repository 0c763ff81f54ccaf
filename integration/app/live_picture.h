#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "integration/app/feel_view.h"
#include "integration/app/palpation.h"
#include "integration/app/session.h"
#include "module/view/picture.h"

namespace palpate::app {

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
  SceneMoment moment;
  double picture_s = 0.0;  ///< that drawing and reading it back took
};

/// Draws what is felt again and again, on a thread of its own: the window goes on taking the mouse
/// while a slow device draws.
class LivePicture {
 public:
  /// Starts at once; draws from the first want() on. `palpation` is borrowed, and its newest
  /// moment is read here alone.
  LivePicture(Palpation& palpation, const DeviceOptions& gpu);
  ~LivePicture();
  LivePicture(const LivePicture&) = delete;
  LivePicture& operator=(const LivePicture&) = delete;

  /// From the next picture on. Any thread.
  void want(const WantedPicture& wanted);
  /// The last that was drawn; null before the first. Any thread.
  std::shared_ptr<const LiveFrame> newest() const;
  /// Why there are no pictures any more: a sentence, or nothing. Any thread.
  std::string trouble() const;

 private:
  void run(std::stop_token stop);
  Status draw(std::stop_token stop);

  Palpation& palpation_;
  DeviceOptions gpu_;
  mutable std::mutex mutex_;  ///< of what follows but the thread
  WantedPicture wanted_;
  std::shared_ptr<const LiveFrame> newest_;
  std::string trouble_;
  std::jthread thread_;
};

}  // namespace palpate::app
