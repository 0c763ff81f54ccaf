#include "integration/charts/frame_bar.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "integration/charts/range.h"
#include "integration/charts/timeline.h"

namespace palpate::charts {
namespace {

constexpr Color kPlate{0.055, 0.065, 0.085}, kBarInk{0.93, 0.94, 0.96}, kBarQuiet{0.62, 0.66, 0.73};
constexpr Color kTrack{0.30, 0.33, 0.39}, kDone{0.30, 0.78, 0.98};
constexpr double kPlateAlpha = 0.80, kPlateRound = 9.0;
constexpr double kSide = 44.0;  // from the plate's edge to the ends of the time axis
constexpr double kBarPad = 6.0, kBarText = 17.0, kBarRow = 18.0;
constexpr double kTrackHeight = 5.0, kMark = 9.0, kKnob = 6.0;
constexpr double kLeastBetweenMarks = 4.0;
constexpr double kSizesHead = 24.0, kSizesFoot = 20.0;

/// The time within the sequence, s.
double time_within(const FrameTimes& times, double time_s) {
  if (!times.cyclic()) return std::clamp(time_s, 0.0, times.length_s());
  return time_s - times.cycle_s * std::floor(time_s / times.cycle_s);
}

/// The time axis of a plate.
struct TimeAxis {
  double left = 0.0, width = 1.0, length_s = 1.0;
  double x(double time_s) const { return left + width * time_s / length_s; }
};

TimeAxis time_axis(const FrameTimes& times, double width_px, double scale) {
  const double side = kSide * scale;
  return {side, std::max(1.0, width_px - 2.0 * side), std::max(times.length_s(), 1e-12)};
}

/// A curve between the frames, closed where the sequence repeats.
double size_at(const SizeCurve& curve, const FrameTimes& times, double time_s) {
  const FramePointer at = pointer_at(times, time_s);
  const auto& v = curve.values;
  if (size_t(at.frame) >= v.size()) return std::nan("");
  if (!(at.phase > 0.0)) return v[size_t(at.frame)];
  return glm::mix(v[size_t(at.frame)], v[size_t(at.frame + 1) % v.size()], at.phase);
}

bool is_known_curve(const SizeCurve& curve) {
  return std::count_if(curve.values.begin(), curve.values.end(),
                       [](double v) { return std::isfinite(v); }) > 1;
}

/// The curves of one axis, from 0 on.
struct SizeAxis {
  std::vector<const SizeCurve*> curves;
  const char* unit = "";
  Align side = Align::kLeft;
  double high() const {
    double most = 0.0;
    for (const SizeCurve* curve : curves)
      for (const double value : curve->values)
        if (std::isfinite(value)) most = std::max(most, value);
    return most > 0.0 ? 1.08 * most : 1.0;
  }
};

/// The volumes at the left, the wall at the right.
std::array<SizeAxis, 2> size_axes(const SegmentSizes& sizes) {
  constexpr size_t kMostCurves = 3;
  std::array<SizeAxis, 2> axes{SizeAxis{{}, "ml", Align::kLeft}, SizeAxis{{}, "mm", Align::kRight}};
  for (size_t s = 0; s < sizes.volumes_ml.size() && axes[0].curves.size() < kMostCurves; ++s)
    if ((sizes.cavity < 0 || sizes.cavity == int(s)) && is_known_curve(sizes.volumes_ml[s]))
      axes[0].curves.push_back(&sizes.volumes_ml[s]);
  if (is_known_curve(sizes.wall_mm)) axes[1].curves.push_back(&sizes.wall_mm);
  return axes;
}

void draw_size_curve(Canvas& canvas, const SizeCurve& curve, const FrameTimes& times,
                     const TimeAxis& axis, double top, double height, double high, double scale) {
  const Color colour{curve.colour.r, curve.colour.g, curve.colour.b};
  std::vector<glm::dvec2> points;
  const auto end = [&] {
    if (points.size() > 1) canvas.draw_line(points, colour, 1.8 * scale);
    points.clear();
  };
  const size_t count = std::min(curve.values.size(), times.times_s.size());
  for (size_t k = 0; k < count + (times.cyclic() ? 1 : 0); ++k) {
    const double value = curve.values[k % count];
    if (!std::isfinite(value)) {
      end();
      continue;
    }
    const double time_s = k < count ? times.times_s[k] : times.cycle_s;
    points.push_back({axis.x(time_s), top + height * (1.0 - value / high)});
  }
  end();
}

}  // namespace

int frame_bar_height_px(const FrameBar& bar, double scale) {
  return int((2.0 * kBarPad + kBarRow + (bar.text.empty() ? 0.0 : kBarText)) * scale);
}

double frame_bar_share(double x_px, int width_px, double scale) {
  const double side = kSide * scale;
  return std::clamp((x_px - side) / std::max(1.0, width_px - 2.0 * side), 0.0, 1.0);
}

Bitmap draw_frame_bar(const FrameBar& bar, int width_px, double scale) {
  const int height_px = frame_bar_height_px(bar, scale);
  Canvas canvas(width_px, height_px);
  canvas.fill_box({0.0, 0.0}, {width_px, height_px}, kPlate, kPlateAlpha, kPlateRound * scale);
  const TimeAxis axis = time_axis(bar.times, width_px, scale);
  double y = kBarPad * scale;
  if (!bar.text.empty()) {
    y += kBarText * scale;
    canvas.draw_text(bar.text, {axis.left, y - 4.0 * scale},
                     {.size_px = 12.0 * scale, .color = kBarQuiet, .max_width_px = axis.width});
  }
  y += 0.5 * kBarRow * scale;
  const double track = kTrackHeight * scale, now = axis.x(time_within(bar.times, bar.time_s));
  canvas.fill_box({axis.left, y - 0.5 * track}, {axis.width, track}, kTrack, 1.0, 0.5 * track);
  canvas.fill_box({axis.left, y - 0.5 * track}, {now - axis.left, track}, kDone, 1.0, 0.5 * track);
  const std::vector<double>& times_s = bar.times.times_s;
  if (axis.width >= kLeastBetweenMarks * scale * double(times_s.size()))
    for (const double time_s : times_s) {
      const double x = axis.x(time_s);
      canvas.draw_line({{x, y - 0.5 * kMark * scale}, {x, y + 0.5 * kMark * scale}}, kBarInk, scale,
                       0.7);
    }
  canvas.fill_dot({now, y}, kKnob * scale, kBarInk);
  return canvas.raster();
}

bool has_sizes(const SegmentSizes& sizes) {
  const auto axes = size_axes(sizes);
  return !axes[0].curves.empty() || !axes[1].curves.empty();
}

Bitmap draw_sizes(const SegmentSizes& sizes, const FrameTimes& times, double time_s,
                  glm::ivec2 size_px, double scale) {
  Canvas canvas(size_px.x, size_px.y);
  canvas.fill_box({0.0, 0.0}, size_px, kPlate, kPlateAlpha, kPlateRound * scale);
  const TimeAxis axis = time_axis(times, size_px.x, scale);
  const double top = kSizesHead * scale, text = 11.0 * scale;
  const double height = std::max(1.0, size_px.y - top - kSizesFoot * scale);
  double name_x = 14.0 * scale;
  for (const SizeAxis& of : size_axes(sizes)) {
    if (of.curves.empty()) continue;
    const bool at_left = of.side == Align::kLeft;
    const double high = of.high();
    for (const double tick : axis_ticks(0.0, high, 3)) {
      const double y = top + height * (1.0 - tick / high);
      if (at_left)
        canvas.draw_line({{axis.left, y}, {axis.left + axis.width, y}}, kBarQuiet, scale,
                         tick == 0.0 ? 0.55 : 0.2);
      canvas.draw_text(
          number(tick),
          {at_left ? axis.left - 6.0 * scale : axis.left + axis.width + 6.0 * scale,
           y + 4.0 * scale},
          {.size_px = text, .color = kBarQuiet, .align = at_left ? Align::kRight : Align::kLeft});
    }
    for (const SizeCurve* curve : of.curves) {
      draw_size_curve(canvas, *curve, times, axis, top, height, high, scale);
      // The name with the number at this time, in the curve's colour.
      const double value = size_at(*curve, times, time_s);
      const std::string words =
          curve->name + (at_left ? "" : ", thickness") +
          (std::isfinite(value) ? fmt::format(": {} {}", number(value), of.unit) : "");
      TextStyle name{.size_px = 12.0 * scale,
                     .bold = true,
                     .color = {curve->colour.r, curve->colour.g, curve->colour.b},
                     .max_width_px = 0.48 * size_px.x / double(of.curves.size())};
      const double right_x = size_px.x - 14.0 * scale;
      if (!at_left) {
        // All that the names at the left have left.
        name.align = Align::kRight;
        name.max_width_px = right_x - name_x;
      }
      canvas.draw_text(words, {at_left ? name_x : right_x, 16.0 * scale}, name);
      name_x += std::min(canvas.text_width(words, name), name.max_width_px) + 14.0 * scale;
    }
  }
  const double now = axis.x(time_within(times, time_s)), foot = size_px.y - 6.0 * scale;
  canvas.draw_line({{now, top}, {now, top + height}}, kBarInk, 2.0 * scale);
  TextStyle end{.size_px = text, .color = kBarQuiet};
  canvas.draw_text("0", {axis.left, foot}, end);
  end.align = Align::kRight;
  canvas.draw_text(times.assumed ? "100 %" : fmt::format("{:.0f} ms", 1e3 * times.length_s()),
                   {axis.left + axis.width, foot}, end);
  return canvas.raster();
}

}  // namespace palpate::charts
