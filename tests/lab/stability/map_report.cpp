#include "tests/lab/stability/map_report.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include <fmt/format.h>

#include "tests/lab/report/plot.h"

namespace palpate::stability {
namespace {

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
                           const char* meaning, report::CellMark mark) {
  report::MarkedCells cells{meaning, mark, {}};
  for (size_t i = 0; i < side.cells.size(); ++i)
    if (side.cells[i].outcome == outcome)
      cells.cells.emplace_back(i % map.x.at.size(), i / map.x.at.size());
  return cells;
}

/// The methods' panels as one picture.
report::HeatMap plot_of(const StabilityMap& map) {
  report::HeatMap plot;
  plot.title = map.title;
  plot.x = axis_of(map.x);
  plot.y = axis_of(map.y);
  plot.x_values = map.x.at;
  plot.y_values = map.y.at;
  plot.bar = {with_unit(map.colour, map.colour_unit), map.logarithmic, map.lowest, map.highest};
  for (const Border& border : map.borders) {
    report::Border& line = plot.borders.emplace_back();
    line.name = "theory: " + border.name;
    for (const glm::dvec2 p : border.points) line.points.emplace_back(p.x, p.y);
  }
  for (const Side& side : map.sides) {
    report::Panel& panel = plot.panels.emplace_back();
    panel.title = side.method;
    for (const Cell& cell : side.cells) panel.values.push_back(cell.value);
    panel.marks = {
        marked(map, side, Outcome::kFlagged, "it failed, and said so", report::CellMark::kDot),
        marked(map, side, Outcome::kSilent, "it failed, and nobody was told (no mark: it held)",
               report::CellMark::kCross)};
  }
  plot.width_px = 470;
  plot.height_px = 380;
  return plot;
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
  std::string id = map.group + map.name;  // letters and digits only
  std::erase_if(id, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); });
  auto picture = report::drawn(plot_of(map), id);
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
