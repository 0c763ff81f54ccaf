#include "integration/charts/timeline.h"

#include <algorithm>
#include <cmath>

#include "integration/charts/canvas.h"
#include "integration/charts/range.h"

namespace palpate::charts {
namespace {

constexpr double kStripMargin = 48, kLeft = 96, kTitle = 96, kBottom = 64, kStripGap = 30;
constexpr Color kStripPaper{1.0, 1.0, 1.0};
constexpr Color kStripInk{0.13, 0.15, 0.19};
constexpr Color kStripSoft{0.42, 0.45, 0.50};
constexpr Color kGrid{0.90, 0.91, 0.93};
constexpr Color kBack{0.975, 0.978, 0.984};
constexpr Color kShade{0.96, 0.70, 0.36};

/// A strip's place on the page and what its pixels mean.
struct StripLayout {
  glm::dvec2 corner, size;
  Range x, y;

  double px_x(double value) const { return corner.x + size.x * x.fraction(value); }
  double px_y(double value) const { return corner.y + size.y * (1.0 - y.fraction(value)); }
};

Range range_of(const Strip& strip) {
  double low = 1e300, high = -1e300;
  for (const Curve& curve : strip.curves)
    for (const double value : curve.values)
      if (std::isfinite(value)) {
        low = std::min(low, value);
        high = std::max(high, value);
      }
  if (low > high) low = 0.0, high = 1.0;
  // Space above and below; the axis starts at zero if it would nearly do so.
  const double air = 0.06 * std::max(high - low, 1e-12);
  if (low >= 0.0 && low < 0.4 * high)
    low = 0.0;
  else
    low -= air;
  high += air;
  if (std::isfinite(strip.low)) low = strip.low;
  if (std::isfinite(strip.high)) high = strip.high;
  if (!(high > low)) high = low + 1.0;
  return {low, high};
}

void draw_axes(Canvas& canvas, const StripLayout& frame, const Strip& strip, bool last,
               const std::string& x_title) {
  canvas.fill_box(frame.corner, frame.size, kBack, 1.0, 4.0);
  for (const double tick :
       axis_ticks(frame.y.low, frame.y.high, std::max(2, int(frame.size.y / 60)))) {
    const double y = frame.px_y(tick);
    canvas.draw_line({{frame.corner.x, y}, {frame.corner.x + frame.size.x, y}}, kGrid, 1.0);
    canvas.draw_text(number(tick), {frame.corner.x - 10, y + 5},
                     {.size_px = 14, .color = kStripSoft, .align = Align::kRight});
  }
  for (const double tick : axis_ticks(frame.x.low, frame.x.high, 12)) {
    const double x = frame.px_x(tick);
    canvas.draw_line({{x, frame.corner.y}, {x, frame.corner.y + frame.size.y}}, kGrid, 1.0);
    if (last)
      canvas.draw_text(number(tick), {x, frame.corner.y + frame.size.y + 22},
                       {.size_px = 14, .color = kStripSoft, .align = Align::kCentre});
  }
  if (last)
    canvas.draw_text(x_title,
                     {frame.corner.x + 0.5 * frame.size.x, frame.corner.y + frame.size.y + 46},
                     {.size_px = 15, .color = kStripSoft, .align = Align::kCentre});
  canvas.draw_text_upwards(strip.title, {34, frame.corner.y + 0.5 * frame.size.y},
                           {.size_px = 15,
                            .bold = true,
                            .color = kStripInk,
                            .align = Align::kCentre,
                            .max_width_px = frame.size.y + 20});
}

/// The curve as one line; where several samples share a pixel, from their least to their greatest.
void draw_curve(Canvas& canvas, const StripLayout& frame, const std::vector<double>& x,
                const Curve& curve) {
  std::vector<glm::dvec2> line;
  const auto flush = [&] {
    if (line.size() > 1)
      canvas.draw_line(line, curve.color, curve.width_px);
    else if (line.size() == 1)
      canvas.fill_dot(line[0], curve.width_px, curve.color);
    line.clear();
  };
  for (size_t k = 0; k < x.size();) {
    if (!std::isfinite(curve.values[k])) {
      flush();
      ++k;
      continue;
    }
    const double column = std::floor(frame.px_x(x[k]));
    double low = curve.values[k], high = low, first = low, last = low;
    size_t end = k;
    for (; end < x.size() && std::floor(frame.px_x(x[end])) == column &&
           std::isfinite(curve.values[end]);
         ++end) {
      last = curve.values[end];
      low = std::min(low, last);
      high = std::max(high, last);
    }
    if (end == k + 1) {
      line.push_back({frame.px_x(x[k]), frame.px_y(first)});
    } else {
      for (const double value : {first, low, high, last})
        line.push_back({column + 0.5, frame.px_y(value)});
    }
    k = end;
  }
  flush();
}

void draw_strip(Canvas& canvas, const StripLayout& frame, const Timeline& timeline,
                const Strip& strip, bool last) {
  draw_axes(canvas, frame, strip, last, timeline.x_title);
  canvas.push_clip(frame.corner, frame.size, 4.0);
  for (const Span& span : strip.spans) {
    const double from = frame.px_x(span.from), to = std::max(from + 1.0, frame.px_x(span.to));
    canvas.fill_box({from, frame.corner.y}, {to - from, frame.size.y}, kShade, 0.22);
    if (to - from > 40.0)
      canvas.draw_text(span.word, {from + 6, frame.corner.y + frame.size.y - 8},
                       {.size_px = 13, .color = kStripSoft, .max_width_px = to - from - 8});
  }
  for (const Curve& curve : strip.curves) draw_curve(canvas, frame, timeline.x, curve);
  canvas.pop_clip();
  double at = frame.corner.x + frame.size.x;
  for (auto curve = strip.curves.rbegin(); curve != strip.curves.rend(); ++curve) {
    if (curve->name.empty()) continue;
    const TextStyle style{.size_px = 14, .color = kStripInk, .align = Align::kRight};
    canvas.draw_text(curve->name, {at, frame.corner.y - 8}, style);
    at -= canvas.text_width(curve->name, style) + 8;
    canvas.draw_line({{at - 22, frame.corner.y - 13}, {at, frame.corner.y - 13}}, curve->color,
                     3.0);
    at -= 44;
  }
}

Status checked(const std::string& path, const Timeline& timeline) {
  const auto bad = [&](const std::string& what) -> Status {
    return Error{ErrorKind::kBadInput, path + ": the timeline can not be drawn: " + what};
  };
  if (timeline.x.empty() || timeline.strips.empty()) return bad("there is nothing in it");
  for (const Strip& strip : timeline.strips)
    for (const Curve& curve : strip.curves)
      if (curve.values.size() != timeline.x.size())
        return bad("the curve '" + curve.name + "' has not one value per sample");
  return Nothing{};
}

}  // namespace

std::vector<double> axis_ticks(double low, double high, int wanted) {
  std::vector<double> ticks;
  if (!(high > low) || !std::isfinite(high - low)) return ticks;
  double step = round_down_125((high - low) / std::max(wanted, 1));
  while ((high - low) / step > wanted + 1) {
    const double digit = step / std::pow(10.0, std::floor(std::log10(step) + 1e-9));
    step *= digit > 1.5 && digit < 3.0 ? 2.5 : 2.0;
  }
  for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k)
    ticks.push_back(k * step);
  return ticks;
}

Status draw_timeline(Canvas& canvas, const Timeline& timeline, double y_px) {
  if (const Status fine = checked("timeline", timeline); !fine) return fine;
  double shares = 0.0;
  for (const Strip& strip : timeline.strips) shares += strip.share;
  const double gaps = kStripGap * double(timeline.strips.size() - 1);
  const double height = timeline.height_px - kStripGap - kBottom - gaps;
  const double first = timeline.x.front(), last = timeline.x.back();
  double y = y_px + kStripGap;
  for (size_t k = 0; k < timeline.strips.size(); ++k) {
    const Strip& strip = timeline.strips[k];
    const StripLayout frame{
        {kLeft, y},
        {timeline.width_px - kLeft - kStripMargin, height * strip.share / shares},
        {first, last > first ? last : first + 1.0},
        range_of(strip)};
    draw_strip(canvas, frame, timeline, strip, k + 1 == timeline.strips.size());
    y += frame.size.y + kStripGap;
  }
  return Nothing{};
}

Status write_timeline(const std::string& path, const Timeline& timeline) {
  if (const Status fine = checked(path, timeline); !fine) return fine;
  Canvas canvas(timeline.width_px, timeline.height_px, kStripPaper);
  const double width = timeline.width_px - 2 * kStripMargin;
  canvas.draw_text(timeline.title, {kStripMargin, 48},
                   {.size_px = 26, .bold = true, .color = kStripInk, .max_width_px = width});
  canvas.draw_text(timeline.subtitle, {kStripMargin, 74},
                   {.size_px = 16, .color = kStripSoft, .max_width_px = width});
  Timeline below = timeline;
  below.height_px -= int(kTitle);
  if (const Status drawn = draw_timeline(canvas, below, kTitle); !drawn) return drawn;
  return canvas.save(path);
}

}  // namespace palpate::charts
