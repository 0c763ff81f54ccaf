// Tables of the real CT, pair by pair, palpate and peers.
#include <algorithm>

#include <fmt/format.h>

#include "tests/lab/bench/motion_tables.h"
#include "tests/lab/studies/motion_study.h"

namespace palpate::bench {
namespace {

using Methods = std::vector<std::unique_ptr<PairMethod>>;

StudyRun run_of(const MotionBench& bench) {
  StudyRun run;
  run.context = bench.context;
  run.quick = bench.quick;
  run.runs = bench.runs;
  return run;
}

/// The presets and then the peers. With faster_than_fast also settings between "fast" and the
/// peers: these show at which time palpate is as accurate as the best peer.
Methods methods_of(const MotionBench& bench, bool faster_than_fast) {
  Methods methods = palpate_methods(run_of(bench), true);
  std::erase_if(methods, [&](const auto& method) {
    return !method->is_preset() && !(faster_than_fast && method->name().starts_with("fast"));
  });
  for (auto& peer : bench.peers()) methods.push_back(std::move(peer));
  return methods;
}

/// Throws Mismatch if a field is no better than no motion: its time would mean nothing.
MotionMeasures measured(const MotionBench& bench, const MotionCase& known, Methods methods) {
  MotionMeasures all = measure_motion(run_of(bench), known, std::move(methods));
  for (const std::string& sentence : all.missing) throw Mismatch(sentence);
  for (const MotionMeasure& row : all.rows)
    if (!(row.error_mm < all.still_error_mm))
      throw Mismatch(
          fmt::format("{}: an error of {:.3f} mm is no better than no motion's ({:.3f}).", row.name,
                      row.error_mm, all.still_error_mm));
  return all;
}

/// The rows as in the chart, and the error with each axis in its own voxels.
Table table_of(const MotionMeasures& all) {
  Table table = motion_table(all);
  table.title = all.name;
  table.note += " Own axes: each component in voxels of its own axis.";
  table.columns.push_back({"error_own_voxels", "own axes"});
  table.columns.push_back({"error_p95_own_voxels", "95 %"});
  for (size_t n = 0; n < all.rows.size(); ++n) {
    table.rows[n].push_back(number(all.rows[n].own_voxels, 3));
    table.rows[n].push_back(number(all.rows[n].own_voxels_p95, 3));
  }
  return table;
}

MotionCase breath_of(const MotionBench& bench, const CtData& ct) {
  if (!bench.quick) return ct.breath;
  MotionCase half = halved(ct.breath);
  half.name += ", halved";
  return half;
}

}  // namespace

Table breath_table(MotionBench& bench, const CtData& ct) {
  const MotionCase breath = breath_of(bench, ct);
  const MotionMeasures all = measured(bench, breath, methods_of(bench, true));
  const MotionMeasure* peer = nullptr;
  for (const MotionMeasure& row : all.rows)
    if (!row.ours && (!peer || row.error_mm < peer->error_mm)) peer = &row;
  Table table = table_of(all);
  table.note +=
      " Sooner: than the peer with the smallest error, given where the error is no larger than "
      "that.";
  table.columns.push_back({"times_sooner", "x sooner"});
  table.columns.push_back({"device_bytes_per_voxel", "B/voxel"});
  for (size_t n = 0; n < all.rows.size(); ++n) {
    const MotionMeasure& row = all.rows[n];
    const bool as_good = peer && row.error_mm <= peer->error_mm;
    const double bytes = row.device_bytes / double(all.voxels);
    table.rows[n].push_back(as_good ? number(peer->seconds / row.seconds, 1) : nothing());
    table.rows[n].push_back(row.ours ? number(bytes, 1) : nothing());
    if (!row.ours && &row != peer) continue;
    const std::string who = row.ours ? row.name : "peer";
    if (as_good) bench.found["sooner"][who] = peer->seconds / row.seconds;
    if (row.ours) bench.found["bytes"][who] = bytes;
    bench.found["error mean"][who] = row.own_voxels;
    bench.found["error p95"][who] = row.own_voxels_p95;
    bench.found["folds"][who] += double(row.folded);
  }
  return table;
}

std::vector<Table> step_tables(MotionBench& bench, const CtData& ct) {
  std::vector<Table> tables;
  for (const MotionCase& step : ct.steps) {
    const MotionMeasures all = measured(bench, step, methods_of(bench, false));
    for (const MotionMeasure& row : all.rows)
      if (row.ours) bench.found["folds"][row.name] += double(row.folded);
    tables.push_back(table_of(all));
  }
  return tables;
}

Table gain_table(MotionBench& bench, const CtData& ct) {
  const MotionCase plain = breath_of(bench, ct);
  const MotionCase low = with_gain(plain, 0.7), high = with_gain(plain, 1.4);
  Table table;
  table.title = "The whole breath with another contrast in the moving frame";
  table.note =
      "Endpoint error, each axis in its own voxels. Values above air times 0.7 or 1.4, and a bias "
      "from 0.8 to 1.2 across the body.";
  table.columns = {{"method", "method"},
                   {"plain_voxels", "plain"},
                   {"gain_0_7_voxels", "gain 0.7"},
                   {"gain_1_4_voxels", "gain 1.4"},
                   {"increase_percent", "more error %"}};
  for (const auto& method : methods_of(bench, false)) {
    // classic does not support another contrast.
    if (method->is_ours() && method->runs_once()) continue;
    std::vector<double> errors;
    for (const MotionCase* pair : {&plain, &low, &high}) {
      const auto result = method->run(pair->fixed, pair->moving);
      if (!result) throw Mismatch(method->name() + ": " + result.error().message);
      // Here a result need not be better than no motion: the peers' are not, and this is the
      // finding.
      const auto error = error_of(result->field, *pair);
      if (!error) throw Mismatch(error.error().message);
      errors.push_back(error->own_voxels.mean);
    }
    const double increase = 100.0 * (std::max(errors[1], errors[2]) / errors[0] - 1.0);
    table.rows.push_back({words(method->name()), number(errors[0], 3), number(errors[1], 3),
                          number(errors[2], 3), number(increase, 1)});
    auto& found = bench.found["gain increase"];
    if (method->is_ours())
      found[method->name()] = increase;
    else
      found["peer"] = found.contains("peer") ? std::min(found["peer"], increase) : increase;
  }
  return table;
}

}  // namespace palpate::bench
