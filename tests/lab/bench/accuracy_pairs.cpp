// Tables of the real CT, pair by pair, with ITK's filters beside.
#include <algorithm>

#include <fmt/format.h>

#include "compute/motion/options.h"
#include "compute/motion/quality.h"
#include "tests/lab/bench/accuracy_tables.h"
#include "tests/lab/bench/contender.h"

namespace palpate::bench {
namespace {

struct Scored {
  peers::EndpointError error;
  double mean_mm = 0.0, p95_mm = 0.0;
  size_t folded = 0;
};

/// Throws Mismatch if the field is no better than none: its time would mean nothing.
Scored scored(const Field& field, const peers::KnownPair& pair, const std::string& who) {
  Scored result;
  result.error = peers::endpoint_error(field, pair);
  const auto still = peers::endpoint_error(still_field(pair.truth.grid), pair);
  if (!(result.error.mean_voxels < still.mean_voxels)) {
    throw Mismatch(
        fmt::format("{}: an error of {:.3f} voxels is no better than no motion's ({:.3f}).", who,
                    result.error.mean_voxels, still.mean_voxels));
  }
  const double finest_mm = pair.truth.grid.finest_mm();
  result.mean_mm = result.error.mean_finest * finest_mm;
  result.p95_mm = result.error.p95_finest * finest_mm;
  result.folded = folds(field).folded;
  return result;
}

std::vector<Column> score_columns() {
  return {{"method", "method"},
          {"error_mean_voxels", "mean voxel"},
          {"error_p95_voxels", "p95"},
          {"error_mean_mm", "mean mm"},
          {"error_p95_mm", "p95"},
          {"folds", "folds"},
          {"seconds", "s"}};
}

std::vector<Cell> score_cells(const std::string& who, const Scored& s, double seconds) {
  return {words(who),
          number(s.error.mean_voxels, 3),
          number(s.error.p95_voxels, 3),
          number(s.mean_mm, 3),
          number(s.p95_mm, 3),
          number(double(s.folded), 0),
          number(seconds, 3)};
}

std::vector<std::unique_ptr<Contender>> presets(const AccuracyBench& bench,
                                                const peers::KnownPair& pair) {
  std::vector<std::unique_ptr<Contender>> result;
  for (const char* preset : {"fast", "balanced", "best"})
    result.push_back(palpate_contender(bench.context, preset, *motion_preset(preset), pair));
  return result;
}

constexpr const char* kUnits =
    "Endpoint error inside the body. Voxel: each component divided by its own axis' spacing.";

Table empty_pair_table(const AccuracyBench& bench) {
  Table table;
  table.title = "Real chest CT, whole breath (up to 15.5 mm)";
  table.note = fmt::format(
      "{} Medians of {} in alternation, {} threads. Seconds: palpate from frames in host memory to "
      "the field there, kernels warm (conversion, upload, pyramid, solving, download); ITK the "
      "registration with its pyramid. Cold: the first run of a fresh estimator, kernels compiled. "
      "Sooner: than the ITK row with the smallest error, given where the error is no larger than "
      "that.",
      kUnits, bench.runs, bench.threads);
  table.columns = score_columns();
  table.columns.push_back({"cold_s", "cold s"});
  table.columns.push_back({"times_sooner", "x sooner"});
  table.columns.push_back({"device_bytes_per_voxel", "B/voxel"});
  return table;
}

}  // namespace

Table pair_table(AccuracyBench& bench, const LungData& lung) {
  const peers::KnownPair& pair = lung.pair;
  auto contenders = presets(bench, pair);
  // Between the next two lies how soon palpate is as good as the best peer.
  MotionOptions half = *motion_preset("fast");
  half.finest_level = 1;
  MotionOptions one = *motion_preset("fast");
  one.levels[0].iterations = 1;
  for (const auto& [name, options] : {std::pair("fast, down to half resolution", half),
                                      {"fast, one iteration on the finest level", one},
                                      {"classic", *motion_preset("classic")}})
    contenders.push_back(palpate_contender(bench.context, name, options, pair));
  const size_t ours = contenders.size();
  for (const auto& setting : itk_settings(bench.threads))
    contenders.push_back(itk_contender(setting));
  const auto outcomes = alternate(contenders, pair.fixed, pair.moving, bench.runs);

  std::vector<Scored> scores;
  for (size_t c = 0; c < contenders.size(); ++c)
    scores.push_back(scored(outcomes[c].field, pair, contenders[c]->name()));
  size_t peer = ours;
  for (size_t c = ours; c < contenders.size(); ++c)
    if (scores[c].error.mean_voxels < scores[peer].error.mean_voxels) peer = c;

  Table table = empty_pair_table(bench);
  for (size_t c = 0; c < contenders.size(); ++c) {
    auto row = score_cells(contenders[c]->name(), scores[c], outcomes[c].seconds);
    const bool as_good = scores[c].error.mean_voxels <= scores[peer].error.mean_voxels;
    const double sooner = outcomes[peer].seconds / outcomes[c].seconds;
    const double bytes = contenders[c]->device_bytes() / double(pair.fixed.grid.count());
    row.push_back(c < ours ? number(contenders[c]->cold_s(), 3) : nothing());
    row.push_back(as_good ? number(sooner, 1) : nothing());
    row.push_back(c < ours ? number(bytes, 1) : nothing());
    table.rows.push_back(row);
    const std::string who = c < ours ? contenders[c]->name() : c == peer ? "ITK" : "";
    if (who.empty()) continue;
    if (as_good) bench.found["sooner"][who] = sooner;
    if (c < ours) bench.found["bytes"][who] = bytes;
    bench.found["error mean"][who] = scores[c].error.mean_voxels;
    bench.found["error p95"][who] = scores[c].error.p95_voxels;
    bench.found["folds"][who] += double(scores[c].folded);
  }
  return table;
}

Table gain_table(AccuracyBench& bench, const LungData& lung) {
  Table table;
  table.title = "The same with another contrast in the moving frame";
  table.note = fmt::format(
      "{} Values above air times 0.7 or 1.4 and a bias from 0.8 to 1.2 across the body.", kUnits);
  table.columns = {{"method", "method"},
                   {"plain_voxels", "plain"},
                   {"gain_0_7_voxels", "gain 0.7"},
                   {"gain_1_4_voxels", "gain 1.4"},
                   {"increase_percent", "more error %"}};
  auto contenders = presets(bench, lung.pair);
  contenders.push_back(itk_contender(itk_settings(bench.threads).back()));
  const peers::KnownPair low = with_gain(lung.pair, 0.7), high = with_gain(lung.pair, 1.4);
  for (auto& contender : contenders) {
    std::vector<double> errors;
    for (const peers::KnownPair* pair : {&lung.pair, &low, &high}) {
      const Outcome outcome = contender->run(pair->fixed, pair->moving);
      // No demand to be better than nothing here: the peers are not, and that is the finding.
      errors.push_back(peers::endpoint_error(outcome.field, *pair).mean_voxels);
    }
    const double increase = 100.0 * (std::max(errors[1], errors[2]) / errors[0] - 1.0);
    table.rows.push_back({words(contender->name()), number(errors[0], 3), number(errors[1], 3),
                          number(errors[2], 3), number(increase, 1)});
    bench.found["gain increase"][contender->cold_s() > 0.0 ? contender->name() : "ITK"] = increase;
  }
  return table;
}

Table steps_table(AccuracyBench& bench, const LungData& lung) {
  Table table;
  table.title = "Real chest CT, two steps of the breathing";
  table.note = fmt::format("{} One run each. No motion is the error of a field of zeros.", kUnits);
  table.columns = score_columns();
  table.columns.insert(table.columns.begin(), {"pair", "pair"});
  auto contenders = presets(bench, lung.pair);
  for (const auto& setting : itk_settings(bench.threads))
    contenders.push_back(itk_contender(setting));
  for (const auto& [name, pair] : {std::pair("1 to 2", &lung.step_1), {"3 to 4", &lung.step_3}}) {
    const auto still = peers::endpoint_error(still_field(pair->truth.grid), *pair);
    const double mm = pair->truth.grid.finest_mm();
    table.rows.push_back({words(name), words("no motion"), number(still.mean_voxels, 3),
                          number(still.p95_voxels, 3), number(still.mean_finest * mm, 3),
                          number(still.p95_finest * mm, 3), nothing(), nothing()});
    for (auto& contender : contenders) {
      const Outcome outcome = contender->run(pair->fixed, pair->moving);
      const Scored s = scored(outcome.field, *pair, contender->name());
      auto row = score_cells(contender->name(), s, outcome.seconds);
      row.insert(row.begin(), words(name));
      table.rows.push_back(row);
      if (contender->cold_s() > 0.0) bench.found["folds"][contender->name()] += double(s.folded);
    }
  }
  return table;
}

}  // namespace palpate::bench
