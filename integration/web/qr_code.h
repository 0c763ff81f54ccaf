#pragma once

#include <string>

namespace palpate::web {

/// A QR code of a text for terminals: block characters, light on dark, two rows of modules a line,
/// with the quiet border that cameras need. Empty if the text is too long for a code.
std::string qr_text(const std::string& text);

/// The same as a picture in SVG, black on white.
std::string qr_svg(const std::string& text);

}  // namespace palpate::web
