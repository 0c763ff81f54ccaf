#pragma once

#include <optional>
#include <string>

#include "module/view/volume_renderer.h"

namespace palpate::test {

/// Writes a picture as PNG (RGB, 8 bit); false if the file can not be written. For looking at.
bool write_png(const Picture& picture, const std::string& path);

/// What write_png() wrote, opaque; nothing for another file.
std::optional<Picture> read_png(const std::string& path);

}  // namespace palpate::test
