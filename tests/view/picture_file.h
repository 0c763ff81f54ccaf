#pragma once

#include <optional>
#include <string>

#include "module/view/volume_renderer.h"

namespace palpate::test {

/// Writes a picture as PNG (RGB, 8 bit) for inspection; false if the file can not be written.
bool write_png(const Picture& picture, const std::string& path);

/// A picture that write_png() wrote, opaque; nothing for another file.
std::optional<Picture> read_png(const std::string& path);

}  // namespace palpate::test
