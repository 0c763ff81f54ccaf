#include "tests/lab/studies/motion_section.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>

#include <fmt/format.h>

#include "tests/lab/report/plot.h"
#include "tests/lab/studies/motion_statements.h"

namespace palpate::studies {
namespace {

using report::Chart;
using report::Line;
using report::Mark;
using report::Point;
using report::Series;

// Forward and backward: above this the two disagree.
constexpr double kUnsureVoxels = 0.5;

std::string joined(const std::vector<std::string>& sentences) {
  std::string text;
  for (const std::string& sentence : sentences) text += (text.empty() ? "" : " ") + sentence;
  return text;
}

std::string detail(const MotionMeasure& row) {
  std::string text = fmt::format("{}\n{}, {:.3f} mm of error ({:.3f} voxels)\n", row.family,
                                 time_text(row.seconds), row.error_mm, row.error_voxels());
  text += row.folded ? fmt::format("{} voxels fold", row.folded) : "no folds";
  if (std::isfinite(row.there_and_back_mm))
    text += fmt::format(", inverse consistency {:.3f} mm", row.there_and_back_mm);
  return text;
}

std::vector<size_t> our_front(const MotionMeasures& measures) {
  std::vector<report::Costs> costs;
  for (const MotionMeasure& row : measures.rows)
    costs.push_back(row.ours ? row.costs() : report::Costs{NAN, NAN});
  return report::pareto_front(costs);
}

/// Families in the order of their first row, each with a colour and a mark. Points on the front,
/// presets and peers have their name in the plot.
std::vector<Series> family_series(const MotionMeasures& measures,
                                  const std::vector<size_t>& front) {
  std::vector<Series> series;
  for (size_t n = 0; n < measures.rows.size(); ++n) {
    const MotionMeasure& row = measures.rows[n];
    auto found = std::find_if(series.begin(), series.end(),
                              [&](const Series& s) { return s.name == row.family; });
    if (found == series.end()) {
      series.push_back({row.family, {}, {}, {}, int(series.size())});
      found = series.end() - 1;
    }
    const bool named =
        row.preset || !row.ours || std::find(front.begin(), front.end(), n) != front.end();
    found->points.push_back({row.seconds, row.error_mm, row.name, named, detail(row)});
  }
  return series;
}

/// Marks on top of others: fields with folds, and fields whose forward and backward results
/// disagree.
void add_flags(const MotionMeasures& measures, std::vector<Series>& series) {
  Series folds{"has folds", {}, {}, Mark::kCross, {}};
  Series unsure{
      fmt::format("inverse consistency over {} voxel", kUnsureVoxels), {}, {}, Mark::kRing, {}};
  for (const MotionMeasure& row : measures.rows) {
    const Point at{row.seconds, row.error_mm, "", false};
    if (row.folded > 0) folds.points.push_back(at);
    if (row.there_and_back_mm > kUnsureVoxels * row.voxel_mm) unsure.points.push_back(at);
  }
  for (Series& flags : {std::ref(folds), std::ref(unsure)})
    if (!flags.points.empty()) series.push_back(flags);
}

Chart chart_of(const MotionMeasures& measures) {
  Chart chart;
  chart.title = "Error against time: " + measures.name;
  double least = measures.rows.front().error_mm, most = least;
  for (const MotionMeasure& row : measures.rows) {
    least = std::min(least, row.error_mm);
    most = std::max(most, row.error_mm);
  }
  chart.x = {"Time for a pair of frames (s)", true, {}, {}};
  // If errors differ by large factors, the best ones would be close together at the bottom.
  chart.y = {"Mean error (mm)", most > 6.0 * least, {}, {}};
  const std::vector<size_t> front = our_front(measures);
  chart.series = family_series(measures, front);
  Series stairs{"palpate's front", {}, Line::kStairs, Mark::kNone, 6};
  for (const size_t n : front)
    stairs.points.push_back({measures.rows[n].seconds, measures.rows[n].error_mm, "", false});
  chart.series.push_back(stairs);
  add_flags(measures, chart.series);
  return chart;
}

std::string caption_of(const MotionMeasures& measures) {
  return fmt::format(
      "Further left is faster, further down is better; nothing of palpate lies below and left of "
      "its front. Without any motion the error would be {:.3g} mm. Rest the pointer on a mark to "
      "see what it is.",
      measures.still_error_mm);
}

/// The calibration of the presets' confidence on the pair; nothing if no true field is known.
Result<std::optional<report::Figure>> reliability_figure(const MotionMeasures& measures) {
  std::vector<NamedReliability> presets;
  for (const MotionMeasure& row : measures.rows)
    if (row.reliability) presets.emplace_back(row.name, *row.reliability);
  if (presets.empty()) return std::optional<report::Figure>();
  const Chart chart = reliability_chart(presets, "Calibration of confidence: " + measures.name);
  auto svg = drawn(chart, "reliability" + measures.id);
  if (!svg) return svg.error();
  report::Table table = reliability_table(presets, chart.title);
  const std::string caption =
      table.note + " On the dashed line it is perfectly calibrated; above it, it is too low.";
  return std::optional(report::Figure{chart.title, std::move(*svg), caption, std::move(table)});
}

Result<std::vector<report::Part>> parts_of(const MotionMeasures& measures) {
  std::vector<report::Part> parts;
  const Chart chart = chart_of(measures);
  auto svg = drawn(chart, "motion" + measures.id);
  if (!svg) return svg.error();
  const report::Table table = motion_table(measures);
  parts.push_back(report::Figure{chart.title, std::move(*svg), caption_of(measures), table});
  for (const report::Table& choice : {choice_table(measures), preset_table(measures)})
    if (!choice.rows.empty()) parts.push_back(report::TablePart{choice, false});
  auto reliability = reliability_figure(measures);
  if (!reliability) return reliability.error();
  if (*reliability) parts.emplace_back(std::move(**reliability));
  for (const std::string& missing : measures.missing) parts.push_back(report::Note{missing, true});
  const report::Table sweeps = sweep_table(measures);
  if (!sweeps.rows.empty()) parts.push_back(report::TablePart{sweeps, true});
  parts.push_back(report::TablePart{table, true});
  return parts;
}

}  // namespace

Result<report::Section> motion_section(const std::vector<MotionMeasures>& pairs) {
  report::Section section{"motion", "Motion: seconds against error", "", {}};
  for (const MotionMeasures& measures : pairs) {
    if (measures.rows.empty()) continue;
    // The last pair is the most realistic one: synthetic data come first, then CT, then the user's
    // own.
    const std::string peer = peer_sentence(measures);
    section.answer = measures.name + ". " + joined(deadline_sentences(measures)) +
                     (peer.empty() ? "" : "\n\n" + peer);
    auto parts = parts_of(measures);
    if (!parts) return parts.error();
    std::move(parts->begin(), parts->end(), std::back_inserter(section.parts));
  }
  return section;
}

}  // namespace palpate::studies
