#pragma once

#include <map>
#include <string>
#include <vector>

#include "tests/files/temporary_folder.h"

namespace palpate::app {

/// A headset for the unmodified program: the tests' OpenXR runtime, in real time. The user's
/// actions are sent through a FIFO. During the object's life programs that are started find this
/// headset, and no display.
class MadeHeadset {
 public:
  MadeHeadset();
  ~MadeHeadset();
  MadeHeadset(const MadeHeadset&) = delete;

  /// See tests/xr/runtime/remote.h.
  void say(const std::string& command);
  /// The state of the runtime: the lines of its report, "frames" and so on, by their first word.
  /// Waits for it; empty if it did not come in a minute.
  std::map<std::string, std::string> ask();
  /// The pictures of the last frame, side by side, at the time of the last ask().
  struct Shown {
    int width = 0, height = 0;
    std::string rgb;
    std::vector<float> depth_m;  ///< along the eye's axis, the left eye's picture first
  };
  Shown shown() const;
  /// The report that was written when the program ended.
  std::string left() const;

  const files::TemporaryFolder& folder() const { return folder_; }

 private:
  files::TemporaryFolder folder_;
  int fifo_ = -1;
  int asked_ = 0;
};

}  // namespace palpate::app
