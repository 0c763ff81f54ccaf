#include "integration/headset/room_panel.h"

#include <algorithm>
#include <chrono>

#include "integration/charts/slice_panel.h"

namespace palpate::headset {
namespace {

using charts::Canvas;
using charts::Color;
using charts::TextStyle;

constexpr int64_t kShortest_ns = 200'000'000;  // between two drawings
constexpr Color kPaper{0.055, 0.065, 0.085}, kBright{0.93, 0.95, 0.97}, kDim{0.70, 0.74, 0.80};
constexpr double kMargin = 16.0, kText = 18.0, kRowHeight = 25.0, kForce = 44.0;
constexpr double kWhere = 0.46;  // of the text's width: the names of buttons

/// The text in lines that are not wider than this; a longer word has a line of its own.
std::vector<std::string> wrapped(Canvas& canvas, const std::string& text, const TextStyle& style,
                                 double width_px) {
  std::vector<std::string> lines;
  size_t from = 0;
  while (from < text.size()) {
    size_t end = std::min(text.find(' ', from), text.size());
    while (end < text.size()) {
      const size_t next = std::min(text.find(' ', end + 1), text.size());
      if (canvas.text_width(text.substr(from, next - from), style) > width_px) break;
      end = next;
    }
    lines.push_back(text.substr(from, end - from));
    from = end + 1;
  }
  return lines;
}

std::shared_ptr<const Picture> picture_of(const charts::Bitmap& bitmap) {
  auto picture = std::make_shared<Picture>();
  picture->width = bitmap.width;
  picture->height = bitmap.height;
  picture->colours.reserve(bitmap.pixels.size());
  for (const uint32_t argb : bitmap.pixels)
    picture->colours.push_back((argb & 0xff00ff00U) | (argb & 0xffU) << 16 | (argb >> 16 & 0xffU));
  return picture;
}

}  // namespace

charts::Bitmap draw_room_panel(const RoomText& text) {
  Canvas canvas(kRoomPanelWidth_px, kRoomPanelHeight_px, kPaper);
  double left = kMargin;
  if (text.slices) {
    const charts::Bitmap slices =
        charts::draw_slices({*text.slices, {}, text.colours}, kRoomPanelHeight_px);
    canvas.draw_raster(slices, {0.0, 0.0}, 0.0);
    left += slices.width;
  }
  const double width = kRoomPanelWidth_px - kMargin - left;
  const TextStyle quiet{.size_px = kText, .color = kDim, .max_width_px = width};
  const TextStyle bright{.size_px = kText, .color = kBright, .max_width_px = width};
  double y = kMargin;
  if (!text.force.empty()) {
    y += kForce;
    canvas.draw_text(text.force, {left, y}, {.size_px = kForce, .bold = true, .color = kBright});
    y += 0.4 * kRowHeight;
  }
  const auto write = [&](const std::string& what, const TextStyle& style) {
    for (const std::string& line : wrapped(canvas, what, style, width)) {
      y += kRowHeight;
      canvas.draw_text(line, {left, y}, style);
    }
  };
  write(text.state, bright);
  y += 0.5 * kRowHeight;
  for (const std::string& line : text.lines) write(line, quiet);

  // The buttons stand at the bottom, where they stay while the lines above come and go.
  y = std::max(y + 0.5 * kRowHeight,
               kRoomPanelHeight_px - kMargin - kRowHeight * double(text.help.size()));
  TextStyle where = bright, does = quiet;
  where.max_width_px = kWhere * width - kMargin;
  does.max_width_px = (1.0 - kWhere) * width;
  for (const auto& [part, act] : text.help) {
    y += kRowHeight;
    if (y > kRoomPanelHeight_px - 0.5 * kMargin) break;
    canvas.draw_text(part, {left, y}, where);
    canvas.draw_text(act, {left + kWhere * width, y}, does);
  }
  return canvas.raster();
}

void RoomPanel::want(const RoomText& text, int64_t now_ns) {
  if (drawing_.valid()) {
    if (drawing_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    newest_ = drawing_.get();
  }
  if (any_ && (text == drawn_ || now_ns - started_ns_ < kShortest_ns)) return;
  any_ = true;
  started_ns_ = now_ns;
  drawn_ = text;
  drawing_ = std::async(std::launch::async, [text] { return picture_of(draw_room_panel(text)); });
}

}  // namespace palpate::headset
