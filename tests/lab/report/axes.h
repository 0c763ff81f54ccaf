#pragma once

#include <string>
#include <vector>

#include "tests/lab/report/plot.h"

/// Axes of a plot: what they span, where things are on them, and how gnuplot is told.
namespace palpate::report {

/// What an axis shows.
struct Span {
  double low = 0.0, high = 1.0;
  bool logarithmic = false;

  bool can_show(double value) const;
  /// 0 at low, 1 at high.
  double place(double value) const;
};

/// The span of an axis for these values: what the axis asks for, else all values and a little room.
/// From zero on where all values are above and near it. Needs no value at all.
Span span_of(const Axis& axis, const std::vector<double>& values, double room = 0.06);

/// Places of the plot in the picture, px from the left and the bottom.
struct Frame {
  double left, right, bottom, top;
};

/// The script's part for the frame and both axes: margins, ranges, ticks, titles, grid.
std::string axes_script(const Axis& x, const Axis& y, const Span& x_span, const Span& y_span,
                        const Frame& frame, int width_px, int height_px, bool grid);

/// About how wide a text will be in the plots' font, px.
double text_width_px(const std::string& text);

}  // namespace palpate::report
