#pragma once

#include <limits>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "integration/charts/color.h"

namespace palpate::charts {

class Canvas;

/// A curve over the strip's x values. Values that are not finite leave a gap.
struct Curve {
  std::string name;
  std::vector<double> values;  ///< one per x
  Color color;
  double width_px = 1.6;
};

/// A stretch of x that is shaded, with a word on it.
struct Span {
  double from = 0.0;
  double to = 0.0;
  std::string word;
};

/// One strip of a timeline: curves that share an axis.
struct Strip {
  std::string title;  ///< what, and in which unit: "force, N"
  std::vector<Curve> curves;
  std::vector<Span> spans;
  double low = std::numeric_limits<double>::quiet_NaN();   ///< of the axis; NaN: from the curves
  double high = std::numeric_limits<double>::quiet_NaN();  ///< the same
  double share = 1.0;  ///< of the height, relative to the other strips
};

/// Strips above each other that share one x axis.
struct Timeline {
  std::string title;
  std::string subtitle;
  std::string x_title = "time, s";
  std::vector<double> x;  ///< rising
  std::vector<Strip> strips;
  int width_px = 1800;
  int height_px = 1000;
};

/// Writes the timeline as PNG, whole or not at all. More samples than pixels are drawn as the range
/// that they cover, so that no peak is lost. Errors: kBadInput if a curve has not one value per x
/// or there is nothing to draw, kBadOutput, kOutOfMemory. Any thread.
Status write_timeline(const std::string& path, const Timeline& timeline);

/// Draws the strips only (no title) onto a page, from y_px down, timeline.height_px high and
/// width_px wide. kBadInput as above. For pages that hold more.
Status draw_timeline(Canvas& canvas, const Timeline& timeline, double y_px);

/// Steps of 1, 2 or 5 times a power of ten, about `wanted` of them from low to high: where an axis
/// has its ticks.
std::vector<double> axis_ticks(double low, double high, int wanted);

}  // namespace palpate::charts
