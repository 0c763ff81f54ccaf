// Charts: a script for gnuplot from values.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tests/lab/report/axes.h"
#include "tests/lab/report/gnuplot.h"
#include "tests/lab/report/labels.h"
#include "tests/lab/report/plot.h"
#include "tests/lab/report/style.h"

namespace palpate::report {
namespace {

constexpr double kLeftPx = 76.0, kBottomPx = 58.0, kTopPx = 16.0, kRightPx = 22.0;
constexpr double kKeySampleWidthPx = 46.0, kKeyLinePx = 22.0;

/// gnuplot's number of a mark.
int point_type(Mark mark) {
  switch (mark) {
    case Mark::kCircle:
      return 7;
    case Mark::kSquare:
      return 5;
    case Mark::kTriangle:
      return 9;
    case Mark::kDiamond:
      return 13;
    case Mark::kDown:
      return 11;
    case Mark::kPentagon:
      return 15;
    case Mark::kCross:
      return 2;
    case Mark::kRing:
      return 6;
    case Mark::kNone:
      break;
  }
  return 0;
}

Mark mark_of(const Series& series, size_t place) {
  if (series.mark) return *series.mark;
  constexpr Mark kInTurn[] = {Mark::kCircle,  Mark::kSquare, Mark::kTriangle,
                              Mark::kDiamond, Mark::kDown,   Mark::kPentagon};
  return kInTurn[place % std::size(kInTurn)];
}

/// Marks on top of others are drawn in ink, not in another colour.
const char* colour_of(const Series& series, size_t place) {
  const bool over = series.mark == Mark::kCross || series.mark == Mark::kRing;
  if (!series.colour && over) return kInk;
  return kSeriesColours[size_t(series.colour.value_or(int(place))) % kSeriesColours.size()];
}

double size_of(Mark mark) {
  if (mark == Mark::kRing) return 1.5;
  if (mark == Mark::kCross) return 1.1;
  return mark == Mark::kCircle || mark == Mark::kSquare ? 0.75 : 0.9;
}

/// Everything that is computed before the script is written.
struct Layout {
  const Chart& chart;
  Span x, y;
  Frame frame;

  bool shows(const Point& p) const { return x.can_show(p.x) && y.can_show(p.y); }
  bool within(const Point& p) const {
    const double u = x.place(p.x), v = y.place(p.y);
    return u > -1e-9 && u < 1.0 + 1e-9 && v > -1e-9 && v < 1.0 + 1e-9;
  }
  double x_px(double value) const {
    return frame.left + x.place(value) * (frame.right - frame.left);
  }
  double y_px(double value) const {
    return frame.bottom + y.place(value) * (frame.top - frame.bottom);
  }
};

double key_width_px(const Chart& chart) {
  double widest = 0.0;
  for (const Series& series : chart.series) widest = std::max(widest, text_width_px(series.name));
  return widest > 0.0 ? widest + kKeySampleWidthPx + 14.0 : 0.0;
}

Layout layout_of(const Chart& chart) {
  std::vector<double> x, y;
  for (const Guide& guide : chart.guides) (guide.vertical ? x : y).push_back(guide.value);
  for (const Series& series : chart.series) {
    for (const Point& p : series.points) {
      x.push_back(p.x);
      y.push_back(p.y);
    }
  }
  return {chart,
          span_of(chart.x, x),
          span_of(chart.y, y),
          {kLeftPx, chart.width_px - kRightPx - key_width_px(chart), kBottomPx,
           chart.height_px - kTopPx}};
}

std::string number(double value) {
  return fmt::format("{:.9g}", value);
}

std::string join(const std::vector<std::string>& parts) {
  std::string all;
  for (const std::string& part : parts) all += (all.empty() ? "" : ", \\\n  ") + part;
  return all;
}

/// Data blocks, and the pieces of the plot command that draw them.
struct Script {
  std::string blocks;
  std::vector<std::string> pieces;
  std::vector<std::string> tips;
};

void add_line(const Series& series, const std::string& block, const char* colour, bool in_key,
              Script& script) {
  if (series.line == Line::kNone) return;
  script.pieces.push_back(fmt::format(
      "{} using 1:2 with {} lw {} dt {} lc rgb \"{}\" {}", block,
      series.line == Line::kStairs ? "steps" : "lines", series.line == Line::kStairs ? 1.2 : 1.8,
      series.line == Line::kDashed   ? "(6,4)"
      : series.line == Line::kStairs ? "(3,3)"
                                     : "1",
      colour, in_key ? fmt::format("title \"{}\"", gnuplot_text(series.name)) : "notitle"));
}

void add_series(const Layout& layout, size_t place, Script& script) {
  const Series& series = layout.chart.series[place];
  const std::string block = fmt::format("$series{}", place);
  const char* colour = colour_of(series, place);
  const Mark mark = mark_of(series, place);
  std::string rows;
  for (const Point& p : series.points) {
    if (!layout.shows(p)) continue;
    const bool tip = !p.name.empty() && layout.within(p);
    rows += fmt::format("{} {} \"{}\"\n", number(p.x), number(p.y),
                        tip ? fmt::format("tip{}", script.tips.size()) : "");
    if (tip) script.tips.push_back(p.name + (p.detail.empty() ? "" : "\n" + p.detail));
  }
  if (rows.empty()) return;
  script.blocks += block + " << EOD\n" + rows + "EOD\n";
  const bool marked = mark != Mark::kNone;
  add_line(series, block, colour, !marked && !series.name.empty(), script);
  if (!marked) return;
  const std::string look =
      fmt::format("pt {} ps {} lc rgb \"{}\"", point_type(mark), size_of(mark), colour);
  script.pieces.push_back(fmt::format(
      "{} using 1:2 with points {} {}", block, look,
      series.name.empty() ? "notitle" : fmt::format("title \"{}\"", gnuplot_text(series.name))));
  // The same marks again, with the texts that are shown when the pointer rests on them.
  script.pieces.push_back(
      fmt::format("{} using 1:2:3 with labels hypertext point {} notitle", block, look));
}

std::string guides_script(const Layout& layout) {
  std::string script;
  for (const Guide& guide : layout.chart.guides) {
    const Span& span = guide.vertical ? layout.x : layout.y;
    if (!span.can_show(guide.value)) continue;
    const std::string at = number(guide.value);
    script += guide.vertical
                  ? fmt::format("set arrow from {0},graph 0 to {0},graph 1", at)
                  : fmt::format("set arrow from graph 0,first {0} to graph 1,first {0}", at);
    script += fmt::format(" nohead back lw 1.2 dt (2,3) lc rgb \"{}\"\n", kSoft);
    const std::string where = guide.vertical
                                  ? fmt::format("first {},graph 0.985 offset 0.5,0 left", at)
                                  : fmt::format("graph 0.995,first {} offset 0,0.5 right", at);
    script += fmt::format("set label \"{}\" at {} textcolor rgb \"{}\" font \",12\"\n",
                          gnuplot_text(guide.name), where, kSoft);
  }
  return script;
}

std::string labels_script(const Layout& layout) {
  std::vector<Tag> tags, unnamed;
  for (const Series& series : layout.chart.series) {
    for (const Point& p : series.points) {
      if (!layout.shows(p) || !layout.within(p)) continue;
      Tag tag{layout.x_px(p.x), layout.y_px(p.y), p.labelled ? p.name : ""};
      (p.labelled ? tags : unnamed).push_back(std::move(tag));
    }
  }
  tags.insert(tags.end(), unnamed.begin(), unnamed.end());
  std::string script;
  const Frame& f = layout.frame;
  for (const Placed& placed : placed_labels(tags, f.left + 2, f.right + 14, f.bottom + 2, f.top)) {
    script +=
        fmt::format("set label \"{}\" at screen {:.5f},{:.5f} left front textcolor rgb \"{}\"\n",
                    gnuplot_text(tags[placed.tag].text), placed.x / layout.chart.width_px,
                    (placed.y + 0.5 * kFontPx) / layout.chart.height_px, kInk);
  }
  return script;
}

}  // namespace

Result<std::string> drawn(const Chart& chart, const std::string& id) {
  const Layout layout = layout_of(chart);
  Script script;
  for (size_t n = 0; n < chart.series.size(); ++n) add_series(layout, n, script);
  if (script.pieces.empty()) {
    return Error{ErrorKind::kBadInput,
                 "The plot '" + chart.title + "' has no value that can be shown."};
  }
  std::string text = axes_script(chart.x, chart.y, layout.x, layout.y, layout.frame, chart.width_px,
                                 chart.height_px, true);
  if (key_width_px(chart) > 0.0) {
    text += fmt::format(
        "set key at screen {:.5f},{:.5f} left top Left reverse samplen 1.6 spacing {:.2f} "
        "textcolor rgb \"{}\"\n",
        (layout.frame.right + 12) / chart.width_px, layout.frame.top / chart.height_px,
        kKeyLinePx / (1.25 * kFontPx), kInk);
  } else {
    text += "unset key\n";
  }
  text += guides_script(layout) + labels_script(layout) + script.blocks + "plot " +
          join(script.pieces) + "\n";
  return run_gnuplot(text, chart.width_px, chart.height_px, id, chart.title, script.tips);
}

}  // namespace palpate::report
