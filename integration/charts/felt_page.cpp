#include "integration/charts/felt_page.h"

#include <algorithm>

namespace palpate::charts {
namespace {

constexpr double kMargin = 48, kHead = 104, kGap = 18, kLabel = 34;
constexpr Color kPaper{1.0, 1.0, 1.0}, kInk{0.13, 0.15, 0.19}, kSoft{0.42, 0.45, 0.50};
constexpr int kColumns = 2;

void draw_view(Canvas& canvas, const StereoView& view, glm::dvec2 at) {
  const double width = view.left.width;
  canvas.draw_raster(view.right, at, 6.0);
  canvas.draw_raster(view.left, {at.x + width + 4, at.y}, 6.0);
  const double y = at.y + view.left.height + 22;
  canvas.draw_text(view.label, {at.x, y}, {.size_px = 16, .bold = true, .color = kInk});
  canvas.draw_text(view.sublabel, {at.x + 2 * width + 4, y},
                   {.size_px = 15, .color = kSoft, .align = Align::kRight});
}

}  // namespace

Status write_felt_page(const std::string& path, const FeltPage& page) {
  int width = 0, height = 0;
  for (const StereoView& view : page.views) {
    width = std::max(width, view.left.width);
    height = std::max(height, view.left.height);
  }
  const int rows = (int(page.views.size()) + kColumns - 1) / kColumns;
  const double cell_width = 2 * width + 4 + kGap, cell_height = height + kLabel + kGap;
  const int page_width =
      page.views.empty() ? page.timeline.width_px : int(2 * kMargin + kColumns * cell_width - kGap);
  const double below = kHead + rows * cell_height;
  Timeline timeline = page.timeline;
  timeline.width_px = page_width;
  Canvas canvas(page_width, int(below) + timeline.height_px, kPaper);
  canvas.draw_text(
      page.title, {kMargin, 50},
      {.size_px = 28, .bold = true, .color = kInk, .max_width_px = page_width - 2 * kMargin});
  canvas.draw_text(page.subtitle, {kMargin, 80},
                   {.size_px = 16, .color = kSoft, .max_width_px = page_width - 2 * kMargin});
  for (size_t v = 0; v < page.views.size(); ++v)
    draw_view(
        canvas, page.views[v],
        {kMargin + double(v % kColumns) * cell_width, kHead + double(v / kColumns) * cell_height});
  if (const Status drawn = draw_timeline(canvas, timeline, below); !drawn) return drawn;
  return canvas.save(path);
}

Status write_stereo_view(const std::string& path, const StereoView& view) {
  Canvas canvas(view.left.width + view.right.width, view.left.height, kPaper);
  canvas.draw_raster(view.left, {0.0, 0.0}, 0.0);
  canvas.draw_raster(view.right, {double(view.left.width), 0.0}, 0.0);
  return canvas.save(path);
}

}  // namespace palpate::charts
