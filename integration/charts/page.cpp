#include "integration/charts/page.h"

#include <algorithm>
#include <cmath>

#include "integration/charts/canvas.h"

namespace palpate::charts {
namespace {

constexpr double kMargin = 40.0;
constexpr double kGap = 16.0;
constexpr double kTightRowGap = 16.0;
constexpr double kUprightGutter = 34.0;
constexpr double kWideGutter = 200.0;
constexpr double kNarrowestColumn = 190.0;
constexpr double kHighestPanels = 5000.0;
constexpr double kRadius = 7.0;
constexpr double kHeaderHeight = 84.0;
constexpr double kColumnHeadingHeight = 54.0;
constexpr double kKeyHeight = 62.0;
constexpr double kFootnoteHeight = 30.0;

constexpr Color kPaper{0.985, 0.985, 0.98};
constexpr Color kNoData{0.925, 0.93, 0.935};
constexpr Color kInk{0.11, 0.13, 0.17};
constexpr Color kSoftInk{0.40, 0.43, 0.48};

bool has_keys(const Page& page) {
  return std::any_of(page.columns.begin(), page.columns.end(),
                     [](const Column& column) { return !column.keys.empty(); });
}

double scale_of(const Page& page) {
  double width_mm = 0.0;
  for (size_t column = 0; column < page.columns.size(); ++column) {
    double widest = 0.0;
    for (const auto& row : page.cells) {
      widest = std::max(widest, extent_on(row[column].view, page.box).x);
    }
    width_mm += widest;
  }
  double height_mm = 0.0;
  for (const auto& row : page.cells) {
    double highest = 0.0;
    for (const Cell& cell : row) highest = std::max(highest, extent_on(cell.view, page.box).y);
    height_mm += highest;
  }
  return std::min(page.wanted_width_px / width_mm, kHighestPanels / height_mm);
}

Panel panel_of(const Page& page, View view, double px_per_mm) {
  Panel panel;
  panel.view = view;
  panel.px_per_mm = px_per_mm;
  panel.size_px = glm::max(glm::round(extent_on(view, page.box) * px_per_mm), glm::dvec2(8.0));
  const ViewAxes& axes = axes_of(view);
  const glm::dvec3 centre = page.box.centre_mm();
  panel.middle_lps_mm = centre + axes.normal * glm::dot(axes.normal, page.focus_lps_mm - centre);
  return panel;
}

void draw_key(Canvas& canvas, const ColorKey& key, glm::dvec2 corner, double width) {
  constexpr double kThick = 11.0;
  Bitmap bar{int(width), int(kThick), {}};
  for (int row = 0; row < bar.height; ++row) {
    for (int x = 0; x < bar.width; ++x) {
      const Color c = color_at(key.map, (x + 0.5) / bar.width);
      const auto byte = [](double v) { return uint32_t(std::lround(255.0 * v)); };
      bar.pixels.push_back(0xFF000000u | (byte(c.r) << 16) | (byte(c.g) << 8) | byte(c.b));
    }
  }
  corner = glm::round(corner);
  canvas.draw_raster(bar, corner, 0.5 * kThick);
  canvas.draw_box(corner + 0.5, {bar.width - 1.0, kThick - 1.0}, kInk, 0.18, 0.5 * kThick);
  constexpr int kTicks = 4;
  for (int tick = 0; tick <= kTicks; ++tick) {
    const double t = double(tick) / kTicks;
    TextStyle style{13.0, false, kSoftInk, Align::kCentre};
    if (tick == 0) style.align = Align::kLeft;
    if (tick == kTicks) style.align = Align::kRight;
    const double value = key.range.low + t * (key.range.high - key.range.low);
    canvas.draw_text(number(value), {corner.x + t * bar.width, corner.y + kThick + 16.0}, style);
  }
  TextStyle label{13.5, false, kInk, Align::kCentre, width + 20.0};
  canvas.draw_text(key.label, {corner.x + 0.5 * width, corner.y + kThick + 36.0}, label);
}

void draw_panel(Canvas& canvas, const Content& content, const Panel& panel) {
  canvas.fill_box(panel.corner_px, panel.size_px, kNoData, 1.0, kRadius);
  canvas.draw_raster(rasterised(content, panel), panel.corner_px, kRadius);
  canvas.push_clip(panel.corner_px, panel.size_px, kRadius);
  for (const PanelOverlay& overlay : content.overlays) overlay(canvas, panel);
  canvas.pop_clip();
  canvas.draw_box(panel.corner_px + 0.5, panel.size_px - 1.0, kInk, 0.22, kRadius);
}

void draw_headings(Canvas& canvas, const Page& page, const Layout& layout) {
  const double full = layout.width_px - 2.0 * kMargin;
  canvas.draw_text(page.heading.title, {kMargin, kMargin + 24.0},
                   {29.0, true, kInk, Align::kLeft, full});
  canvas.draw_text(page.heading.subtitle, {kMargin, kMargin + 55.0},
                   {18.0, false, kSoftInk, Align::kLeft, full});
  const double y = layout.row_y.front() - kColumnHeadingHeight;
  for (size_t n = 0; n < page.columns.size(); ++n) {
    const double middle = layout.column_x[n] + 0.5 * layout.column_width[n];
    const double width = layout.column_width[n] + 0.5 * kGap;
    canvas.draw_text(page.columns[n].heading.title, {middle, y + 16.0},
                     {18.0, true, kInk, Align::kCentre, width});
    canvas.draw_text(page.columns[n].heading.subtitle, {middle, y + 38.0},
                     {14.5, false, kSoftInk, Align::kCentre, width});
  }
  for (size_t n = 0; n < page.rows.size(); ++n) {
    const double middle = layout.row_y[n] + 0.5 * layout.row_height[n];
    if (page.wide_row_headings) {
      canvas.draw_text(page.rows[n].title, {kMargin, middle - 4.0},
                       {19.0, true, kInk, Align::kLeft, kWideGutter - 16.0});
      canvas.draw_text(page.rows[n].subtitle, {kMargin, middle + 20.0},
                       {14.5, false, kSoftInk, Align::kLeft, kWideGutter - 16.0});
    } else {
      canvas.draw_text_upwards(page.rows[n].title, {kMargin + 14.0, middle},
                               {15.0, false, kSoftInk, Align::kCentre, layout.row_height[n]});
    }
  }
}

}  // namespace

Layout laid_out(const Page& page) {
  Layout layout;
  layout.px_per_mm = scale_of(page);
  const double gutter =
      page.rows.empty() ? 0.0 : (page.wide_row_headings ? kWideGutter : kUprightGutter);
  double x = kMargin + gutter;
  for (size_t column = 0; column < page.columns.size(); ++column) {
    double width = kNarrowestColumn;
    for (const auto& row : page.cells) {
      width = std::max(width, panel_of(page, row[column].view, layout.px_per_mm).size_px.x);
    }
    layout.column_x.push_back(x);
    layout.column_width.push_back(width);
    x += width + kGap;
  }
  layout.width_px = int(std::ceil(x - kGap + kMargin));
  double y = kMargin + kHeaderHeight + kColumnHeadingHeight;
  for (const auto& row : page.cells) {
    double height = 0.0;
    std::vector<Panel> panels;
    for (const Cell& cell : row) {
      panels.push_back(panel_of(page, cell.view, layout.px_per_mm));
      height = std::max(height, panels.back().size_px.y);
    }
    for (size_t column = 0; column < panels.size(); ++column) {
      const glm::dvec2 spare =
          glm::dvec2(layout.column_width[column], height) - panels[column].size_px;
      panels[column].corner_px = glm::floor(glm::dvec2(layout.column_x[column], y) + 0.5 * spare);
    }
    layout.panels.push_back(std::move(panels));
    layout.row_y.push_back(y);
    layout.row_height.push_back(height);
    y += height + kTightRowGap;
  }
  layout.below_panels_y = y;
  layout.height_px =
      int(std::ceil(y + (has_keys(page) ? kKeyHeight : 0.0) +
                    (page.footnote.empty() ? 0.0 : kFootnoteHeight) + kMargin - kTightRowGap));
  return layout;
}

Status write_page(const std::string& path, const Page& page, const Layout& layout) {
  Canvas canvas(layout.width_px, layout.height_px, kPaper);
  if (!canvas.good()) return canvas.save(path);
  draw_headings(canvas, page, layout);
  for (size_t row = 0; row < page.cells.size(); ++row) {
    for (size_t column = 0; column < page.columns.size(); ++column) {
      draw_panel(canvas, *page.cells[row][column].content, layout.panels[row][column]);
    }
  }
  for (size_t n = 0; n < page.columns.size(); ++n) {
    if (page.columns[n].keys.empty()) continue;
    const double width = std::min(300.0, layout.column_width[n] - 24.0);
    const double left = layout.column_x[n] + 0.5 * (layout.column_width[n] - width);
    draw_key(canvas, page.columns[n].keys.front(), {left, layout.below_panels_y}, width);
  }
  const TextStyle small{13.5, false, kSoftInk, Align::kLeft, layout.width_px - 2.0 * kMargin};
  canvas.draw_text(page.footnote, {kMargin, layout.height_px - kMargin + 8.0}, small);
  return canvas.save(path);
}

}  // namespace palpate::charts
