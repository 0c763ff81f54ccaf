// Heat maps: a script for gnuplot from values.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tests/lab/report/axes.h"
#include "tests/lab/report/gnuplot.h"
#include "tests/lab/report/plot.h"
#include "tests/lab/report/style.h"

namespace palpate::report {
namespace {

constexpr double kMapLeftPx = 76.0, kMapBottomPx = 58.0, kMapTopPx = 16.0, kMapRightPx = 22.0;
// Colours and their numbers.
constexpr double kBarPx = 96.0;
constexpr double kKeyRowPx = 24.0;

/// Borders of the cells along an axis: half way between neighbours, one more than values.
std::vector<double> edges_of(const std::vector<double>& values, bool logarithmic) {
  const auto to = [&](double v) { return logarithmic ? std::log(v) : v; };
  const auto back = [&](double v) { return logarithmic ? std::exp(v) : v; };
  const size_t count = values.size();
  std::vector<double> edges(count + 1);
  for (size_t n = 1; n < count; ++n) edges[n] = 0.5 * (to(values[n - 1]) + to(values[n]));
  const double first = to(values.front()), last = to(values.back());
  edges[0] = count > 1 ? 2.0 * first - edges[1] : first - 0.5;
  edges[count] = count > 1 ? 2.0 * last - edges[count - 1] : last + 0.5;
  for (double& edge : edges) edge = back(edge);
  return edges;
}

std::string trouble_with(const std::vector<double>& values, const char* axis, bool logarithmic) {
  if (values.empty()) return fmt::format("no values along {}", axis);
  for (size_t n = 0; n < values.size(); ++n) {
    if (!std::isfinite(values[n])) return fmt::format("a value along {} that is not finite", axis);
    if (logarithmic && values[n] <= 0.0)
      return fmt::format("a value along its logarithmic {} that is not above zero", axis);
    if (n && values[n] <= values[n - 1])
      return fmt::format("values along {} that do not rise", axis);
  }
  return "";
}

std::string trouble_with(const HeatMap& map) {
  if (std::string x = trouble_with(map.x_values, "x", map.x.logarithmic); !x.empty()) return x;
  if (std::string y = trouble_with(map.y_values, "y", map.y.logarithmic); !y.empty()) return y;
  if (map.values.size() != map.x_values.size() * map.y_values.size())
    return fmt::format("{} values for {} x {} cells", map.values.size(), map.x_values.size(),
                       map.y_values.size());
  for (const MarkedCells& marked : map.marks)
    for (const auto& [x, y] : marked.cells)
      if (x >= map.x_values.size() || y >= map.y_values.size())
        return fmt::format("a marked cell ({}, {}) that is not in it", x, y);
  return "";
}

/// The span of the colours: the given one, else exactly that of the values.
Span colours_of(const HeatMap& map) {
  Axis axis{map.bar.title, map.bar.logarithmic, map.bar.low, map.bar.high};
  Span span = span_of(axis, map.values, 0.0);
  return span;
}

std::string palette() {
  std::string colours;
  for (size_t n = 0; n < kMapColours.size(); ++n)
    colours += fmt::format("{}{} \"{}\"", n ? ", " : "", n, kMapColours[n]);
  return "set palette defined (" + colours + ")\n";
}

std::string colour_bar(const HeatMap& map, const Span& span, const Frame& frame, int height_px) {
  const double left = frame.right + 20.0;
  std::string script = palette();
  script += fmt::format("set cbrange [{:.9g}:{:.9g}]\n", span.low, span.high);
  if (span.logarithmic) script += "set logscale cb\nset format cb \"%g\"\n";
  script += fmt::format(
      "set colorbox user origin screen {:.5f},{:.5f} size screen {:.5f},{:.5f} noborder\n"
      "set cbtics scale 0 textcolor rgb \"{}\"\nset cblabel \"{}\" textcolor rgb \"{}\"\n",
      left / map.width_px, frame.bottom / height_px, 14.0 / map.width_px,
      (frame.top - frame.bottom) / height_px, kSoft, gnuplot_text(map.bar.title), kInk);
  return script;
}

/// Lines of a hatch in one cell, in fractions of the cell, so that all cells have the same hatch.
std::string mark_rows(CellMark mark, double x0, double x1, double y0, double y1, bool log_x,
                      bool log_y) {
  const auto along = [](double low, double high, double share, bool logarithmic) {
    return logarithmic ? low * std::pow(high / low, share) : low + share * (high - low);
  };
  const auto row = [&](double a, double b, double c, double d) {
    return fmt::format("{:.9g} {:.9g}\n{:.9g} {:.9g}\n\n", along(x0, x1, a, log_x),
                       along(y0, y1, b, log_y), along(x0, x1, c, log_x), along(y0, y1, d, log_y));
  };
  switch (mark) {
    case CellMark::kHatch:
      return row(0, 0.67, 0.33, 1) + row(0, 0.33, 0.67, 1) + row(0, 0, 1, 1) +
             row(0.33, 0, 1, 0.67) + row(0.67, 0, 1, 0.33);
    case CellMark::kCross:
      return row(0.25, 0.25, 0.75, 0.75) + row(0.25, 0.75, 0.75, 0.25);
    case CellMark::kDot:
      break;
  }
  return fmt::format("{:.9g} {:.9g}\n", along(x0, x1, 0.5, log_x), along(y0, y1, 0.5, log_y));
}

/// Two strokes, a wide white one below a narrow black one, are visible on any colour.
void add_strokes(const std::string& block, const std::string& name, const char* dashes,
                 double width, std::vector<std::string>& pieces) {
  pieces.push_back(fmt::format("{} using 1:2 with lines lw {:.1f} lc rgb \"{}\" notitle", block,
                               width + 2.2, kPaper));
  pieces.push_back(fmt::format(
      "{} using 1:2 with lines lw {:.1f} dt {} lc rgb \"{}\" {}", block, width, dashes, kInk,
      name.empty() ? "notitle" : fmt::format("title \"{}\"", gnuplot_text(name))));
}

/// The key's entry for marked cells.
std::string key_entry(const MarkedCells& marked) {
  const char* look = marked.mark == CellMark::kHatch   ? "with boxes fs pattern 4 border fc"
                     : marked.mark == CellMark::kCross ? "with points pt 2 ps 0.9 lc"
                                                       : "with points pt 7 ps 0.45 lc";
  return fmt::format("keyentry {} rgb \"{}\" title \"{}\"", look, kInk, gnuplot_text(marked.name));
}

/// A value by its name on the axis, else as a number.
std::string said(const Axis& axis, double value) {
  for (const auto& [at, text] : axis.ticks)
    if (at == value) return text;
  return fmt::format("{:g}", value);
}

struct Cells {
  std::vector<double> x_edges, y_edges;
};

std::string cells_blocks(const HeatMap& map, const Cells& cells, const Span& colours,
                         std::vector<std::string>& pieces, std::vector<std::string>& tips) {
  std::string known, missing, all;
  for (size_t y = 0; y < map.y_values.size(); ++y) {
    for (size_t x = 0; x < map.x_values.size(); ++x) {
      const double value = map.values[y * map.x_values.size() + x];
      const std::string box = fmt::format(
          "{:.9g} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g}", map.x_values[x], map.y_values[y],
          cells.x_edges[x], cells.x_edges[x + 1], cells.y_edges[y], cells.y_edges[y + 1]);
      const bool shown = std::isfinite(value);
      if (shown) {
        const double least = colours.logarithmic ? std::max(value, colours.low) : value;
        known += fmt::format("{} {:.9g}\n", box, std::clamp(least, colours.low, colours.high));
      } else {
        missing += box + "\n";
      }
      all +=
          fmt::format("{:.9g} {:.9g} \"tip{}\"\n", map.x_values[x], map.y_values[y], tips.size());
      tips.push_back(fmt::format("{}: {}\n{}: {}\n{}: {}", map.x.title,
                                 said(map.x, map.x_values[x]), map.y.title,
                                 said(map.y, map.y_values[y]), map.bar.title,
                                 shown ? fmt::format("{:.4g}", value) : "not measured"));
    }
  }
  std::string blocks;
  if (!known.empty()) {
    blocks += "$known << EOD\n" + known + "EOD\n";
    pieces.push_back(
        "$known using 1:2:3:4:5:6:7 with boxxyerror fs solid 1 noborder lc palette "
        "notitle");
  }
  if (!missing.empty()) {
    blocks += "$missing << EOD\n" + missing + "EOD\n";
    pieces.push_back(fmt::format(
        "$missing using 1:2:3:4:5:6 with boxxyerror fs solid 1 noborder lc rgb \"{}\" title "
        "\"not measured\"",
        kMissing));
  }
  // An invisible mark, for the tool tip of each cell.
  blocks += "$tips << EOD\n" + all + "EOD\n";
  return blocks;
}

std::string over_blocks(const HeatMap& map, const Cells& cells, std::vector<std::string>& pieces) {
  std::string blocks;
  for (size_t n = 0; n < map.marks.size(); ++n) {
    const MarkedCells& marked = map.marks[n];
    if (marked.cells.empty()) continue;
    const std::string block = fmt::format("$marked{}", n);
    std::string rows;
    for (const auto& [x, y] : marked.cells) {
      rows += mark_rows(marked.mark, cells.x_edges[x], cells.x_edges[x + 1], cells.y_edges[y],
                        cells.y_edges[y + 1], map.x.logarithmic, map.y.logarithmic);
    }
    blocks += block + " << EOD\n" + rows + "EOD\n";
    if (marked.mark == CellMark::kDot) {
      for (const auto& [size, colour] : {std::pair(0.75, kPaper), std::pair(0.45, kInk)})
        pieces.push_back(fmt::format("{} using 1:2 with points pt 7 ps {} lc rgb \"{}\" notitle",
                                     block, size, colour));
    } else {
      add_strokes(block, "", "1", 1.0, pieces);
    }
    if (!marked.name.empty()) pieces.push_back(key_entry(marked));
  }
  constexpr const char* kDashes[] = {"1", "(8,4)", "(2,3)", "(8,3,2,3)"};
  for (size_t n = 0; n < map.borders.size(); ++n) {
    std::string rows;
    for (const auto& [x, y] : map.borders[n].points) rows += fmt::format("{:.9g} {:.9g}\n", x, y);
    if (rows.empty()) continue;
    const std::string block = fmt::format("$border{}", n);
    blocks += block + " << EOD\n" + rows + "EOD\n";
    add_strokes(block, map.borders[n].name, kDashes[n % std::size(kDashes)], 2.0, pieces);
  }
  return blocks;
}

size_t key_entries(const HeatMap& map) {
  const auto named = std::count_if(map.borders.begin(), map.borders.end(),
                                   [](const Border& b) { return !b.name.empty(); });
  const bool missing =
      std::any_of(map.values.begin(), map.values.end(), [](double v) { return !std::isfinite(v); });
  const auto marked = std::count_if(map.marks.begin(), map.marks.end(), [](const MarkedCells& m) {
    return !m.cells.empty() && !m.name.empty();
  });
  return size_t(named) + size_t(marked) + (missing ? 1 : 0);
}

}  // namespace

Result<std::string> drawn(const HeatMap& map, const std::string& id) {
  if (const std::string wrong = trouble_with(map); !wrong.empty())
    return Error{ErrorKind::kBadInput, "The map '" + map.title + "' has " + wrong + "."};
  const Cells cells{edges_of(map.x_values, map.x.logarithmic),
                    edges_of(map.y_values, map.y.logarithmic)};
  const Span x{map.x.low.value_or(cells.x_edges.front()), map.x.high.value_or(cells.x_edges.back()),
               map.x.logarithmic};
  const Span y{map.y.low.value_or(cells.y_edges.front()), map.y.high.value_or(cells.y_edges.back()),
               map.y.logarithmic};
  // The key is above the map in two columns and makes the picture higher, so that it hides no cell.
  const size_t rows = (key_entries(map) + 1) / 2;
  const double key_px = kKeyRowPx * double(rows) + (rows > 0 ? 8.0 : 0.0);
  const int height_px = map.height_px + int(key_px);
  const Frame frame{kMapLeftPx, map.width_px - kMapRightPx - kBarPx, kMapBottomPx,
                    map.height_px - kMapTopPx};
  const Span colours = colours_of(map);
  std::vector<std::string> pieces, tips;
  std::string text = axes_script(map.x, map.y, x, y, frame, map.width_px, height_px, false) +
                     colour_bar(map, colours, frame, height_px);
  text += rows > 0 ? fmt::format(
                         "set key at screen {:.5f},{:.5f} left top Left reverse maxrows {} samplen "
                         "2.4 spacing {:.2f} width 3 textcolor rgb \"{}\"\n",
                         kMapLeftPx / map.width_px, 1.0 - 4.0 / height_px, rows,
                         kKeyRowPx / (1.25 * kFontPx), kInk)
                   : "unset key\n";
  text += cells_blocks(map, cells, colours, pieces, tips);
  text += over_blocks(map, cells, pieces);
  pieces.push_back(
      "$tips using 1:2:3 with labels hypertext point pt 7 ps 1.2 lc rgb "
      "\"#FF000000\" notitle");
  text += "plot ";
  for (size_t n = 0; n < pieces.size(); ++n) text += (n ? ", \\\n  " : "") + pieces[n];
  return run_gnuplot(text + "\n", map.width_px, height_px, id, map.title, tips);
}

}  // namespace palpate::report
