#pragma once

#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tests/files/temporary_folder.h"

namespace palpate::test {

/// What a screen shows: 0xRRGGBB, row 0 at the top.
struct Screenshot {
  int width = 0, height = 0;
  std::vector<uint32_t> pixels;
  uint32_t at(int x, int y) const { return pixels.at(size_t(y) * size_t(width) + size_t(x)); }
  /// As a file that people can look at (binary PPM).
  void save(const std::string& path) const;
};

/// A screen that is not there: an Xvfb of its own, on the first free display, while the object
/// lives. DISPLAY is set to it.
class VirtualDisplay {
 public:
  /// Null, with the reason in `why_not`, where Xvfb or xdotool are missing or do not start.
  static std::unique_ptr<VirtualDisplay> start(int width, int height, std::string& why_not);
  ~VirtualDisplay();
  VirtualDisplay(const VirtualDisplay&) = delete;

  /// What is on the screen, out of the file into which Xvfb itself draws.
  Screenshot screenshot() const;
  /// A person's deed: the arguments of xdotool. False if it failed.
  bool act(const std::string& arguments) const;

 private:
  VirtualDisplay() = default;
  files::TemporaryFolder folder_;
  pid_t pid_ = -1;
};

}  // namespace palpate::test
