#include "tests/lab/stability/map_report.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include <fmt/format.h>

#include "tests/lab/report/plot.h"

namespace palpate::stability {
namespace {

constexpr int kPanelWidth_px = 470, kPanelHeight_px = 380, kTitle_px = 28, kPanelsInARow = 2;
constexpr int kLeft_px = 10, kKeyRow_px = 22, kKeyTop_px = 10;
constexpr const char* kText = "font-family=\"Inter, system-ui, sans-serif\" fill=\"#222222\"";

const char* outcome_word(Outcome outcome) {
  switch (outcome) {
    case Outcome::kHeld:
      return "held";
    case Outcome::kFlagged:
      return "failed and said so";
    case Outcome::kSilent:
      return "failed unseen";
  }
  return "";
}

std::string with_unit(const std::string& name, const std::string& unit) {
  return unit.empty() ? name : fmt::format("{} ({})", name, unit);
}

/// If there are few cells each has its value: they are the measured values, with nothing between or
/// beyond.
report::Axis axis_of(const Axis& axis) {
  constexpr size_t kFew = 7;
  report::Axis drawn{with_unit(axis.name, axis.unit), axis.logarithmic, {}, {}};
  if (!axis.words.empty() || axis.at.size() <= kFew)
    for (size_t i = 0; i < axis.at.size(); ++i)
      drawn.ticks.emplace_back(axis.at[i], value_text(axis, i));
  return drawn;
}

report::MarkedCells marked(const StabilityMap& map, const Side& side, Outcome outcome,
                           report::CellMark mark) {
  report::MarkedCells cells{"", mark, {}};
  for (size_t i = 0; i < side.cells.size(); ++i)
    if (side.cells[i].outcome == outcome)
      cells.cells.emplace_back(i % map.x.at.size(), i / map.x.at.size());
  return cells;
}

/// The border with points between its points: of a long segment only a part with an end in the
/// picture would be drawn.
std::vector<std::pair<double, double>> drawn_points(const StabilityMap& map, const Border& border) {
  constexpr int kPieces = 64;
  const auto between = [](double a, double b, double t, bool logarithmic) {
    return logarithmic && a > 0.0 && b > 0.0 ? a * std::pow(b / a, t) : a + t * (b - a);
  };
  std::vector<std::pair<double, double>> points;
  for (size_t n = 0; n + 1 < border.points.size(); ++n)
    for (int k = 0; k <= kPieces; ++k) {
      const glm::dvec2 a = border.points[n], b = border.points[n + 1];
      const double t = double(k) / kPieces;
      points.emplace_back(between(a.x, b.x, t, map.x.logarithmic),
                          between(a.y, b.y, t, map.y.logarithmic));
    }
  return points;
}

report::HeatMap panel_of(const StabilityMap& map, const Side& side) {
  report::HeatMap panel;
  panel.title = map.title + ": " + side.method;
  panel.x = axis_of(map.x);
  panel.y = axis_of(map.y);
  panel.x_values = map.x.at;
  panel.y_values = map.y.at;
  for (const Cell& cell : side.cells) panel.values.push_back(cell.value);
  panel.bar = {with_unit(map.colour, map.colour_unit), map.logarithmic, map.lowest, map.highest};
  for (const Border& border : map.borders) {
    panel.borders.push_back({"", drawn_points(map, border)});
  }
  panel.marks = {marked(map, side, Outcome::kFlagged, report::CellMark::kDot),
                 marked(map, side, Outcome::kSilent, report::CellMark::kCross)};
  panel.width_px = kPanelWidth_px;
  panel.height_px = kPanelHeight_px;
  return panel;
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text)
    result += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
  return result;
}

/// The key: the meaning of marks and lines of all panels, each in a row above them.
std::string key_of(const StabilityMap& map) {
  // As report::HeatMap draws them.
  constexpr const char* kDashes[] = {"", "8 4", "2 3", "8 3 2 3"};
  std::string svg;
  int y = kKeyTop_px + 8;
  const auto row = [&](const std::string& mark, const std::string& text) {
    svg += fmt::format(
        "<g transform=\"translate({} {})\">{}</g><text x=\"{}\" y=\"{}\" {} "
        "font-size=\"13\">{}</text>",
        kLeft_px + 20, y, mark, kLeft_px + 50, y + 5, kText, escaped(text));
    y += kKeyRow_px;
  };
  row("<circle r=\"3.5\" fill=\"#222222\"/>", "it failed, and said so");
  row("<path d=\"M-6 -6 L6 6 M-6 6 L6 -6\" stroke=\"#222222\" stroke-width=\"1.5\"/>",
      "it failed, and nobody was told (no mark: it held)");
  for (size_t b = 0; b < map.borders.size(); ++b)
    row(fmt::format("<path d=\"M-14 0 L14 0\" stroke=\"#222222\" stroke-width=\"2\" "
                    "stroke-dasharray=\"{}\"/>",
                    kDashes[b % std::size(kDashes)]),
        "theory: " + map.borders[b].name);
  return svg;
}

/// The methods' panels as one picture.
Result<std::string> picture_of(const StabilityMap& map) {
  const int panels = int(map.sides.size()), wide = std::min(panels, kPanelsInARow);
  const int rows = (panels + kPanelsInARow - 1) / kPanelsInARow;
  const int top = kKeyTop_px + kKeyRow_px * int(2 + map.borders.size());
  const int width = kLeft_px + wide * kPanelWidth_px;
  const int height = top + rows * (kPanelHeight_px + kTitle_px);
  std::string svg = fmt::format(
      "<svg role=\"img\" xmlns=\"http://www.w3.org/2000/svg\" "
      "xmlns:xlink=\"http://www.w3.org/1999/xlink\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
      "height=\"{1}\"><title>{2}</title><rect width=\"{0}\" height=\"{1}\" fill=\"#FFFFFF\"/>",
      width, height, escaped(map.title));
  svg += key_of(map);
  std::string id = map.group + map.name;  // letters and digits only
  std::erase_if(id, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); });
  for (int p = 0; p < panels; ++p) {
    const Side& side = map.sides[size_t(p)];
    auto panel = report::drawn(panel_of(map, side), fmt::format("{}{}", id, p));
    if (!panel) return panel.error();
    // The title of a long axis may extend beyond it.
    panel->replace(0, 4, "<svg overflow=\"visible\"");
    const int x = kLeft_px + p % kPanelsInARow * kPanelWidth_px;
    const int y = top + p / kPanelsInARow * (kPanelHeight_px + kTitle_px);
    svg += fmt::format(
        "<text x=\"{}\" y=\"{}\" {} font-size=\"15\" font-weight=\"600\">{}</text><g "
        "transform=\"translate({} {})\">{}</g>",
        x + 76, y + 21, kText, escaped(side.method), x, y + kTitle_px, *panel);
  }
  return svg + "</svg>";
}

}  // namespace

report::Table table_of(const StabilityMap& map) {
  report::Table table;
  table.title = map.title;
  table.note = map.made;
  table.columns = {{"method", "method"},
                   {"x", with_unit(map.x.name, map.x.unit)},
                   {"y", with_unit(map.y.name, map.y.unit)},
                   {"value", with_unit(map.colour, map.colour_unit)},
                   {"outcome", "outcome"}};
  const auto at = [](const Axis& axis, size_t i) {
    return axis.words.empty() ? report::number(axis.at[i], 4) : report::words(axis.words[i]);
  };
  for (const Side& side : map.sides)
    for (size_t c = 0; c < side.cells.size(); ++c)
      table.rows.push_back({report::words(side.method), at(map.x, c % map.x.at.size()),
                            at(map.y, c / map.x.at.size()), report::number(side.cells[c].value, 6),
                            report::words(outcome_word(side.cells[c].outcome))});
  return table;
}

Result<report::Section> section_of(const StabilityMap& map) {
  auto picture = picture_of(map);
  if (!picture) return picture.error();
  report::Figure figure;
  figure.title = map.title;
  figure.svg = std::move(*picture);
  figure.caption = fmt::format(
      "{} Colour: {}. A failure is when {}. No mark: it held; a dot: it failed and said so; a "
      "cross: it failed unseen. The line is where theory sees the border.",
      map.made, with_unit(map.colour, map.colour_unit), map.failed);
  figure.data = table_of(map);
  report::Section section{
      map.group + "-" + report::file_stem(map.name), map.title, meaning(map), {}};
  section.parts.emplace_back(std::move(figure));
  return section;
}

std::string whole_meaning(const std::vector<StabilityMap>& maps) {
  Tally ours, others;
  std::string unseen;
  for (const StabilityMap& map : maps)
    for (size_t s = 0; s < map.sides.size(); ++s) {
      const Tally of = tally(map.sides[s]);
      Tally& sum = s + 1 == map.sides.size() ? ours : others;
      sum.held += of.held;
      sum.flagged += of.flagged;
      sum.silent += of.silent;
      if (&sum == &ours && of.silent)
        unseen += fmt::format("{}'{}'", unseen.empty() ? "" : ", ", map.title);
    }
  std::string text = fmt::format(
      "In {} maps palpate holds in {} of {} cells, fails and says so in {}, and fails unseen in {}",
      maps.size(), ours.held, ours.all(), ours.flagged, ours.silent);
  text += unseen.empty() ? "." : fmt::format(" (in {}).", unseen);
  if (others.all())
    text += fmt::format(" What it is held against holds in {} of {}, and fails unseen in {}.",
                        others.held, others.all(), others.silent);
  return text;
}

}  // namespace palpate::stability
