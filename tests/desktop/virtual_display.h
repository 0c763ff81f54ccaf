#pragma once

#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tests/files/temporary_folder.h"

namespace palpate::test {

/// The content of a screen: 0xRRGGBB, row 0 at the top.
struct Screenshot {
  int width = 0, height = 0;
  std::vector<uint32_t> pixels;
  uint32_t at(int x, int y) const { return pixels.at(size_t(y) * size_t(width) + size_t(x)); }
  /// As a picture file (binary PPM).
  void save(const std::string& path) const;
};

/// A virtual screen: an Xvfb of its own, on the first free display, during the object's life.
/// DISPLAY is set to it.
class VirtualDisplay {
 public:
  /// Null, with the reason in `why_not`, where Xvfb or xdotool are missing or do not start.
  static std::unique_ptr<VirtualDisplay> start(int width, int height, std::string& why_not);
  ~VirtualDisplay();
  VirtualDisplay(const VirtualDisplay&) = delete;

  /// The content of the screen, read from the file into which Xvfb draws.
  Screenshot screenshot() const;
  /// An action of a user: the arguments of xdotool. False if it failed.
  bool act(const std::string& arguments) const;

 private:
  VirtualDisplay() = default;
  files::TemporaryFolder folder_;
  pid_t pid_ = -1;
};

}  // namespace palpate::test
