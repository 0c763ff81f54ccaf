#include "integration/desktop/force_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace palpate::desktop {
namespace {

using charts::Align;
using charts::Canvas;
using charts::Color;
using charts::TextStyle;

constexpr Color kPaper{0.055, 0.065, 0.085};
constexpr Color kInk{0.93, 0.94, 0.96};
constexpr Color kQuiet{0.62, 0.66, 0.73};
constexpr Color kForce{1.0, 0.72, 0.28};

}  // namespace

double readable_top(double force_n) {
  double decade = 1.0;
  for (int d = 0; d < 6; ++d, decade *= 10.0)
    for (const double step : {1.0, 2.0, 5.0})
      if (force_n <= step * decade) return step * decade;
  return decade;
}

double ForcePlot::peak_n() const {
  double peak = 0.0;
  for (const PlottedForce& sample : samples_) peak = std::max(peak, sample.force_n);
  return peak;
}

void ForcePlot::add(double time_s, double force_n) {
  if (!std::isfinite(time_s) || !std::isfinite(force_n)) return;
  if (!samples_.empty() && time_s <= samples_.back().time_s) return;
  samples_.push_back({time_s, std::max(0.0, force_n)});
  while (samples_.front().time_s < time_s - seconds_) samples_.pop_front();
  top_n_ = readable_top(peak_n());
}

charts::Bitmap ForcePlot::draw(int width, int height, double scale) const {
  const glm::dvec2 whole = scale * glm::dvec2(width, height);
  Canvas canvas(int(whole.x), int(whole.y));
  canvas.fill_box({0.0, 0.0}, whole, kPaper, 0.80, 9.0 * scale);
  TextStyle title{.size_px = 13.0 * scale, .bold = true, .color = kInk};
  canvas.draw_text("Force", {14.0 * scale, 22.0 * scale}, title);
  TextStyle value{.size_px = 13.0 * scale, .bold = true, .color = kForce, .align = Align::kRight};
  canvas.draw_text(fmt::format("{:.2f} N", newest_n()), {whole.x - 14.0 * scale, 22.0 * scale},
                   value);
  TextStyle peak{.size_px = 11.0 * scale, .color = kQuiet, .align = Align::kCentre};
  canvas.draw_text(fmt::format("highest {:.2f} N", peak_n()), {0.5 * whole.x, 22.0 * scale}, peak);

  const glm::dvec2 corner(40.0 * scale, 34.0 * scale);
  const glm::dvec2 size = whole - corner - scale * glm::dvec2(14.0, 24.0);
  TextStyle mark{.size_px = 11.0 * scale, .color = kQuiet, .align = Align::kRight};
  for (const double share : {0.0, 0.5, 1.0}) {
    const double y = corner.y + (1.0 - share) * size.y;
    canvas.draw_line({{corner.x, y}, {corner.x + size.x, y}}, kQuiet, scale,
                     share == 0.0 ? 0.55 : 0.2);
    canvas.draw_text(fmt::format("{:g}", share * top_n_), {corner.x - 6.0 * scale, y + 4.0 * scale},
                     mark);
  }
  const double below = whole.y - 8.0 * scale;
  mark.align = Align::kLeft;
  canvas.draw_text(fmt::format("{:g} s ago", seconds_), {corner.x, below}, mark);
  mark.align = Align::kRight;
  canvas.draw_text("now", {corner.x + size.x, below}, mark);
  draw_curve(canvas, corner, size, scale);
  return canvas.raster();
}

void ForcePlot::draw_curve(Canvas& canvas, glm::dvec2 corner, glm::dvec2 size, double scale) const {
  if (samples_.size() < 2) return;
  const double now_s = samples_.back().time_s;
  std::vector<glm::dvec2> curve;
  for (const PlottedForce& sample : samples_) {
    const double x = corner.x + size.x * (1.0 - (now_s - sample.time_s) / seconds_);
    const double y = corner.y + size.y * (1.0 - sample.force_n / top_n_);
    // Of several samples in a pixel the greatest is drawn, so that no peak is lost.
    if (curve.size() > 1 && x - curve.back().x < 0.5 * scale)
      curve.back().y = std::min(curve.back().y, y);
    else
      curve.push_back({x, y});
  }
  std::vector<glm::dvec2> area = curve;
  area.push_back({curve.back().x, corner.y + size.y});
  area.push_back({curve.front().x, corner.y + size.y});
  canvas.push_clip(corner - scale * glm::dvec2(0.0, 2.0), size + scale * glm::dvec2(2.0, 3.0), 0.0);
  canvas.fill_polygon(area, kForce, 0.22);
  canvas.draw_line(curve, kForce, 1.8 * scale);
  canvas.pop_clip();
}

}  // namespace palpate::desktop
