// Plots as JSON, which plot.py draws.
#include "tests/lab/report/plot.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tests/lab/report/child.h"

namespace palpate::report {
namespace {

using nlohmann::json;

constexpr const char* kMarks[] = {"circle",   "square", "triangle", "diamond", "down",
                                  "pentagon", "cross",  "ring",     "none"};
constexpr const char* kLines[] = {"none", "straight", "stairs", "dashed"};
constexpr const char* kCellMarks[] = {"hatch", "cross", "dot"};

json value_or_null(const std::optional<double>& value) {
  return value ? json(*value) : json();
}

json json_of(const Axis& axis) {
  return {{"title", axis.title},
          {"logarithmic", axis.logarithmic},
          {"low", value_or_null(axis.low)},
          {"high", value_or_null(axis.high)},
          {"ticks", axis.ticks}};
}

json json_of(const Chart& chart) {
  json series = json::array(), guides = json::array();
  for (const Series& of : chart.series) {
    json points = json::array();
    for (const Point& p : of.points) {
      points.push_back({{"x", p.x},
                        {"y", p.y},
                        {"name", p.name},
                        {"labelled", p.labelled},
                        {"detail", p.detail}});
    }
    series.push_back({{"name", of.name},
                      {"points", points},
                      {"line", kLines[size_t(of.line)]},
                      {"mark", of.mark ? json(kMarks[size_t(*of.mark)]) : json()},
                      {"colour", of.colour ? json(*of.colour) : json()}});
  }
  for (const Guide& guide : chart.guides)
    guides.push_back({{"vertical", guide.vertical}, {"value", guide.value}, {"name", guide.name}});
  json behind;
  if (const auto& picture = chart.behind)
    behind = {{"edges", {picture->left, picture->right, picture->bottom, picture->top}},
              {"columns", picture->columns},
              {"values", picture->values}};
  return {{"x", json_of(chart.x)}, {"y", json_of(chart.y)},      {"series", series},
          {"guides", guides},      {"width_px", chart.width_px}, {"height_px", chart.height_px},
          {"behind", behind}};
}

json json_of(const HeatMap& map) {
  json panels = json::array(), borders = json::array();
  for (const Panel& panel : map.panels) {
    json marks = json::array();
    for (const MarkedCells& of : panel.marks) {
      marks.push_back(
          {{"name", of.name}, {"mark", kCellMarks[size_t(of.mark)]}, {"cells", of.cells}});
    }
    panels.push_back({{"title", panel.title}, {"values", panel.values}, {"marks", marks}});
  }
  for (const Border& border : map.borders)
    borders.push_back({{"name", border.name}, {"points", border.points}});
  return {{"x", json_of(map.x)},
          {"y", json_of(map.y)},
          {"x_values", map.x_values},
          {"y_values", map.y_values},
          {"bar", json_of(Axis{map.bar.title, map.bar.logarithmic, map.bar.low, map.bar.high})},
          {"borders", borders},
          {"panels", panels},
          {"width_px", map.width_px},
          {"height_px", map.height_px}};
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
  if (map.panels.empty()) return "no panel";
  for (const Panel& panel : map.panels) {
    if (panel.values.size() != map.x_values.size() * map.y_values.size())
      return fmt::format("{} values for {} x {} cells", panel.values.size(), map.x_values.size(),
                         map.y_values.size());
    for (const MarkedCells& marked : panel.marks)
      for (const auto& [x, y] : marked.cells)
        if (x >= map.x_values.size() || y >= map.y_values.size())
          return fmt::format("a marked cell ({}, {}) that is not in it", x, y);
  }
  return "";
}

/// Whether a chart has a point that its axes can show.
bool shows_anything(const Chart& chart) {
  const auto can_show = [](const Axis& axis, double value) {
    return std::isfinite(value) && (!axis.logarithmic || value > 0.0);
  };
  return std::any_of(chart.series.begin(), chart.series.end(), [&](const Series& series) {
    return std::any_of(series.points.begin(), series.points.end(), [&](const Point& p) {
      return can_show(chart.x, p.x) && can_show(chart.y, p.y);
    });
  });
}

Error trouble(const std::string& what) {
  return {ErrorKind::kBadInput, what};
}

Result<std::string> drawn_by_script(json plot, const std::string& title, const std::string& id) {
  plot["title"] = title;
  plot["id"] = id;
  const ScratchFolder folder;
  if (folder.path().empty())
    return trouble("No temporary folder can be made for a plot: is the disk full?");
  const auto file = folder.path() / "plot.json", svg = folder.path() / "plot.svg",
             complaints = folder.path() / "complaints";
  std::ofstream out(file);
  // Names of files may be no UTF-8.
  out << plot.dump(-1, ' ', false, json::error_handler_t::replace);
  out.close();
  if (!out) return trouble("A plot could not be written to a file: is the disk full?");
  // Debian's Python, for which its package of matplotlib is.
  const int failed =
      call_program({"/usr/bin/python3", PALPATE_PLOT_SCRIPT, file.string(), svg.string()},
                   folder.path() / "out", complaints);
  if (failed == 0) return text_of(svg);
  std::string why = failed > 0 ? std::strerror(failed) : text_of(complaints);
  while (!why.empty() && why.back() == '\n') why.pop_back();
  return trouble(fmt::format("'{}' could not be drawn: {}", title, why));
}

}  // namespace

Result<std::string> drawn(const Chart& chart, const std::string& id) {
  if (const auto& picture = chart.behind;
      picture && (picture->columns == 0 || picture->values.size() % picture->columns != 0 ||
                  picture->values.empty()))
    return trouble(fmt::format("The plot '{}' has a picture of {} values in rows of {}.",
                               chart.title, picture->values.size(), picture->columns));
  if (!shows_anything(chart))
    return trouble("The plot '" + chart.title + "' has no value that can be shown.");
  return drawn_by_script(json_of(chart), chart.title, id);
}

Result<std::string> drawn(const HeatMap& map, const std::string& id) {
  if (const std::string wrong = trouble_with(map); !wrong.empty())
    return trouble("The map '" + map.title + "' has " + wrong + ".");
  return drawn_by_script(json_of(map), map.title, id);
}

Status check_plots() {
  Chart chart;
  chart.title = "A plot";
  chart.series = {{"", {{1.0, 1.0, "", false}}, {}, {}, {}}};
  const auto plot = drawn(chart);
  return plot ? Status(Nothing{}) : Status(plot.error());
}

}  // namespace palpate::report
