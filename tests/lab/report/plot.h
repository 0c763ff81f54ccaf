#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "compute/volume/result.h"

/// Plots as values, drawn as SVG by matplotlib: plot.py, which is called as a program.
/// Colours are those of Okabe and Ito, which people with any colour vision tell apart, and no two
/// series have the same mark either, so that a plot can be read in grey.
///
///   Chart chart;
///   chart.title = "Error against time";
///   chart.x = {"Time per pair (s)", true};       // true: logarithmic
///   chart.y = {"Endpoint error (voxels)"};
///   chart.series = {{"palpate", {{0.5, 0.16, "fast", true}}}, {"ITK", {{10.9, 0.23, "Demons"}}}};
///   const Result<std::string> svg = drawn(chart);
namespace palpate::report {

/// One axis. The title has the unit in brackets.
struct Axis {
  std::string title;
  /// To base 10; values that are not above zero can not be shown then.
  bool logarithmic = false;
  /// The shown range; if not given, all data and a little room.
  std::optional<double> low, high;
  /// Texts at values: for values that have names, or are few. None: round numbers.
  std::vector<std::pair<double, std::string>> ticks = {};
};

enum class Mark { kCircle, kSquare, kTriangle, kDiamond, kDown, kPentagon, kCross, kRing, kNone };
/// How the points of a series are joined. Stairs go right first, as the cost of a front does.
enum class Line { kNone, kStraight, kStairs, kDashed };

/// One measurement. Name and detail are shown when the pointer rests on the mark; labelled: the
/// name is also beside it, if there is space.
struct Point {
  double x = 0.0, y = 0.0;
  std::string name;
  bool labelled = false;
  std::string detail = {};  ///< further lines
};

/// Points of one kind, with one entry in the key (none for an empty name). Colour (0 to 7: an index
/// into SERIES_COLOURS of plot.py) and mark follow from the place in the list if they are not
/// given.
struct Series {
  std::string name;
  std::vector<Point> points;
  Line line = Line::kNone;
  std::optional<Mark> mark;
  std::optional<int> colour;
};

/// A thin line across the whole plot with its name at the end: a goal, a deadline, a limit.
struct Guide {
  bool vertical = false;  ///< at x = value, else at y = value
  double value = 0.0;
  std::string name;
};

/// A grey picture behind the marks of a chart, whose axes then have one scale.
struct Backdrop {
  double left = 0.0, right = 1.0, bottom = 0.0, top = 1.0;  ///< its edges, in units of the axes
  size_t columns = 0;
  /// [row * columns + column], the lowest row first: 0 black to 1 white; NaN: nothing there.
  std::vector<double> values;
};

/// Marks and lines over two axes. Points that are not finite, or not above zero on a logarithmic
/// axis, are left out.
struct Chart {
  /// A text alternative, and the file's name; not drawn.
  std::string title;
  Axis x, y;
  std::vector<Series> series;
  std::vector<Guide> guides;
  int width_px = 880, height_px = 460;
  std::optional<Backdrop> behind = {};
};

/// The colours of a map: from low to high. Without limits, those of the values.
struct ColourBar {
  std::string title;  ///< with the unit
  bool logarithmic = false;
  /// Values beyond are drawn in the colour of the end.
  std::optional<double> low, high;
};

/// How some cells of a map are marked besides their colour.
enum class CellMark { kHatch, kCross, kDot };
struct MarkedCells {
  /// In the key, once for all panels; empty: no entry.
  std::string name;
  CellMark mark = CellMark::kHatch;
  std::vector<std::pair<size_t, size_t>> cells;  ///< (index along x, index along y)
};

/// A curve over a map, in the units of the axes: a theoretical border. The first is drawn solid,
/// the second dashed, the third dotted, and so on, each in black on white, so that it is visible on
/// any colour.
struct Border {
  std::string name;
  std::vector<std::pair<double, double>> points;
};

/// The values of one map in a picture of several.
struct Panel {
  std::string title;           ///< above the map; empty: none
  std::vector<double> values;  ///< [y * x_values.size() + x]; NaN: not measured, grey
  std::vector<MarkedCells> marks;
};

/// Maps over the same two axes, two beside each other: a value per cell. Cells extend half way to
/// their neighbours (on a logarithmic axis in the logarithm).
struct HeatMap {
  std::string title;
  Axis x, y;
  std::vector<double> x_values, y_values;  ///< rising; at least one each
  ColourBar bar;
  std::vector<Border> borders;
  std::vector<Panel> panels;  ///< at least one
  /// Of a panel without its title. The key is above the panels.
  int width_px = 880, height_px = 440;
};

/// The plot as one <svg> element for a page: ids are unique for the given id (letters and digits),
/// names are shown as tool tips, no script. Errors: kBadInput if python3-matplotlib is not
/// installed (with what to install), if there is nothing to show, or if sizes do not fit. Any
/// thread; starts a process and waits for it.
Result<std::string> drawn(const Chart& chart, const std::string& id = "figure");
Result<std::string> drawn(const HeatMap& map, const std::string& id = "figure");

/// Whether plots can be drawn at all, to be checked before minutes of measuring. Errors: as
/// drawn().
Status check_plots();

}  // namespace palpate::report
