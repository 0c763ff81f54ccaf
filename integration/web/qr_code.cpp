#include "integration/web/qr_code.h"

#include <fmt/format.h>
#include <qrencode.h>

#include <memory>

namespace palpate::web {
namespace {

constexpr int kBorder = 4;  // modules

/// The modules of a code; also beyond its edges, where all are light.
class Modules {
 public:
  explicit Modules(const std::string& text)
      : code_(QRcode_encodeString8bit(text.c_str(), 0, QR_ECLEVEL_L), QRcode_free) {}
  int edge() const { return code_ ? code_->width + 2 * kBorder : 0; }
  bool is_dark(int x, int y) const {
    const int column = x - kBorder, row = y - kBorder, width = code_->width;
    return column >= 0 && row >= 0 && column < width && row < width &&
           (code_->data[row * width + column] & 1) != 0;
  }

 private:
  std::unique_ptr<QRcode, void (*)(QRcode*)> code_;
};

}  // namespace

std::string qr_text(const std::string& text) {
  const Modules modules(text);
  std::string lines;
  for (int y = 0; y < modules.edge(); y += 2) {
    for (int x = 0; x < modules.edge(); ++x) {
      const bool upper = !modules.is_dark(x, y), lower = !modules.is_dark(x, y + 1);
      lines += upper && lower ? "\u2588" : upper ? "\u2580" : lower ? "\u2584" : " ";
    }
    lines += '\n';
  }
  return lines;
}

std::string qr_svg(const std::string& text) {
  const Modules modules(text);
  const int edge = modules.edge();
  if (edge == 0) return {};
  std::string path;
  for (int y = 0; y < edge; ++y)
    for (int x = 0; x < edge; ++x)
      if (modules.is_dark(x, y)) path += fmt::format("M{} {}h1v1h-1z", x, y);
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {0}\" role=\"img\">"
      "<title>The address of this page</title><path d=\"{1}\"/></svg>\n",
      edge, path);
}

}  // namespace palpate::web
