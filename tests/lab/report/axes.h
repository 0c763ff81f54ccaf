#pragma once

#include <string>
#include <vector>

#include "tests/lab/report/plot.h"

/// Axes of a plot: their spans, places on them, and their part of the gnuplot script.
namespace palpate::report {

/// The span of an axis.
struct Span {
  double low = 0.0, high = 1.0;
  bool logarithmic = false;

  bool can_show(double value) const;
  /// 0 at low, 1 at high.
  double place(double value) const;
};

/// The span of an axis for these values: the axis's own limits, else all values and a little room.
/// From zero on if all values are above and near it. Without any value there is a default.
Span span_of(const Axis& axis, const std::vector<double>& values, double room = 0.06);

/// Places of the plot in the picture, px from the left and the bottom.
struct Frame {
  double left, right, bottom, top;
};

/// The script's part for the frame and both axes: margins, ranges, ticks, titles, grid.
std::string axes_script(const Axis& x, const Axis& y, const Span& x_span, const Span& y_span,
                        const Frame& frame, int width_px, int height_px, bool grid);

/// The approximate width of a text in the plots' font, px.
double text_width_px(const std::string& text);

}  // namespace palpate::report
