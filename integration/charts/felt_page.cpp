#include "integration/charts/felt_page.h"

#include <algorithm>

namespace palpate::charts {
namespace {

constexpr double kPageMargin = 48, kHead = 104, kPageGap = 18, kLabel = 34;
constexpr Color kWhite{1.0, 1.0, 1.0}, kDark{0.13, 0.15, 0.19}, kGrey{0.42, 0.45, 0.50};
constexpr int kColumns = 2;

void draw_view(Canvas& canvas, const StereoView& view, glm::dvec2 at) {
  const double width = view.left.width;
  canvas.draw_raster(view.left, at, 6.0);
  canvas.draw_raster(view.right, {at.x + width + 4, at.y}, 6.0);
  const double y = at.y + view.left.height + 22;
  canvas.draw_text(view.label, {at.x, y}, {.size_px = 16, .bold = true, .color = kDark});
  canvas.draw_text(view.sublabel, {at.x + 2 * width + 4, y},
                   {.size_px = 15, .color = kGrey, .align = Align::kRight});
}

}  // namespace

Status write_felt_page(const std::string& path, const FeltPage& page) {
  int width = 0, height = 0;
  for (const StereoView& view : page.views) {
    width = std::max(width, view.left.width);
    height = std::max(height, view.left.height);
  }
  const int rows = (int(page.views.size()) + kColumns - 1) / kColumns;
  const double cell_width = 2 * width + 4 + kPageGap, cell_height = height + kLabel + kPageGap;
  const int page_width = page.views.empty()
                             ? page.timeline.width_px
                             : int(2 * kPageMargin + kColumns * cell_width - kPageGap);
  const double below = kHead + rows * cell_height;
  Timeline timeline = page.timeline;
  timeline.width_px = page_width;
  Canvas canvas(page_width, int(below) + timeline.height_px, kWhite);
  canvas.draw_text(
      page.title, {kPageMargin, 50},
      {.size_px = 28, .bold = true, .color = kDark, .max_width_px = page_width - 2 * kPageMargin});
  canvas.draw_text(page.subtitle, {kPageMargin, 80},
                   {.size_px = 16, .color = kGrey, .max_width_px = page_width - 2 * kPageMargin});
  for (size_t v = 0; v < page.views.size(); ++v)
    draw_view(canvas, page.views[v],
              {kPageMargin + double(v % kColumns) * cell_width,
               kHead + double(v / kColumns) * cell_height});
  if (const Status drawn = draw_timeline(canvas, timeline, below); !drawn) return drawn;
  return canvas.save(path);
}

}  // namespace palpate::charts
