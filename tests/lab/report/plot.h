#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "compute/volume/result.h"

/// Plots as values, drawn as SVG by gnuplot (Debian's gnuplot-nox), which is called as a program.
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

/// One axis. The title carries the unit in brackets.
struct Axis {
  std::string title;
  bool logarithmic = false;         ///< to base 10; what is not above zero can not be shown then
  std::optional<double> low, high;  ///< what is shown; where not given, all data and a little room
  /// What stands at which value: for values that have names, or are few. None: round numbers.
  std::vector<std::pair<double, std::string>> ticks = {};
};

enum class Mark { kCircle, kSquare, kTriangle, kDiamond, kDown, kPentagon, kCross, kRing, kNone };
/// How the points of a series are joined. Stairs go right first: what a front promises.
enum class Line { kNone, kStraight, kStairs, kDashed };

/// One measurement. Name and detail appear when the pointer rests on the mark; labelled: the name
/// also stands beside it, where there is room.
struct Point {
  double x = 0.0, y = 0.0;
  std::string name;
  bool labelled = false;
  std::string detail = {};  ///< further lines
};

/// Points of one kind, with one entry in the key (none for an empty name). Colour (0 to 7: an index
/// into kSeriesColours) and mark follow from the place in the list where they are not given.
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

/// Marks and lines over two axes. Points that are not finite, or not above zero on a logarithmic
/// axis, are left out.
struct Chart {
  std::string title;  ///< for people who can not see it, and the file's name; not drawn
  Axis x, y;
  std::vector<Series> series;
  std::vector<Guide> guides;
  int width_px = 880, height_px = 460;
};

/// The colours of a map: from low to high. Without limits, those of the values.
struct ColourBar {
  std::string title;  ///< with the unit
  bool logarithmic = false;
  std::optional<double> low, high;  ///< values beyond are drawn in the colour of the end
};

/// How some cells of a map are set apart from their colour.
enum class CellMark { kHatch, kCross, kDot };
struct MarkedCells {
  std::string name;  ///< in the key; empty: not there
  CellMark mark = CellMark::kHatch;
  std::vector<std::pair<size_t, size_t>> cells;  ///< (index along x, index along y)
};

/// A curve over a map, in the units of the axes: a theoretical border. The first is drawn solid,
/// the second dashed, the third dotted, and so on, each in black on white, so that it shows on any
/// colour.
struct Border {
  std::string name;
  std::vector<std::pair<double, double>> points;
};

/// A value per cell over two axes. Cells reach half way to their neighbours (on a logarithmic axis
/// in the logarithm).
struct HeatMap {
  std::string title;
  Axis x, y;
  std::vector<double> x_values, y_values;  ///< rising; at least one each
  std::vector<double> values;              ///< [y * x_values.size() + x]; NaN: not measured, grey
  ColourBar bar;
  std::vector<Border> borders;
  std::vector<MarkedCells> marks;
  int width_px = 880, height_px = 440;  ///< without the key, which is set above the map
};

/// The plot as one <svg> element that can stand in a page: ids are unique for the given id (letters
/// and digits), names are shown as tool tips, no script. Errors: kBadInput where gnuplot is not
/// installed (says what to install), where there is nothing to show, or where sizes do not fit.
/// Any thread; starts a process and waits for it.
Result<std::string> drawn(const Chart& chart, const std::string& id = "figure");
Result<std::string> drawn(const HeatMap& map, const std::string& id = "figure");

}  // namespace palpate::report
