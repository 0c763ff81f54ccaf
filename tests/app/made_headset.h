#pragma once

#include <map>
#include <string>
#include <vector>

#include "tests/files/temporary_folder.h"

namespace palpate::app {

/// A headset for the program as it is: the runtime of our own, in real time, told by a FIFO what
/// the person does. While the object lives, programs that are started find it, and no display.
class MadeHeadset {
 public:
  MadeHeadset();
  ~MadeHeadset();
  MadeHeadset(const MadeHeadset&) = delete;

  /// See tests/xr/runtime/remote.h.
  void say(const std::string& command);
  /// How the runtime stands: the lines of its report, "frames" and so on, by their first word.
  /// Waits for it; empty if nothing came in a minute.
  std::map<std::string, std::string> ask();
  /// The pictures that it was last shown, side by side, as of the last ask().
  struct Shown {
    int width = 0, height = 0;
    std::string rgb;
    std::vector<float> depth_m;  ///< along the eye's axis, the left eye's picture first
  };
  Shown shown() const;
  /// The report that it left when the program ended.
  std::string left() const;

  const files::TemporaryFolder& folder() const { return folder_; }

 private:
  files::TemporaryFolder folder_;
  int fifo_ = -1;
  int asked_ = 0;
};

}  // namespace palpate::app
