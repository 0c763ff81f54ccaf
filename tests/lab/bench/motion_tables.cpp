#include "tests/lab/bench/motion_tables.h"

#include <algorithm>

#include <fmt/format.h>

#include "compute/motion/options.h"
#include "compute/motion/quality.h"
#include "compute/volume/phantom.h"
#include "tests/lab/bench/tools.h"
#include "tests/lab/studies/warm_pair.h"

namespace palpate::bench {
namespace {

const std::vector<Column> kPhantomColumns = {
    {"case", "case"},
    {"grid", "grid"},
    {"method", "method"},
    {"error_mean_voxels", "error"},
    {"error_p95_voxels", "p95"},
    {"folds", "folds"},
    {"total_s", "pair s"},
    {"convert_s", "convert"},
    {"prepare_s", "prepare"},
    {"solve_s", "solve"},
    {"download_s", "download"},
    {"device_bytes_per_voxel", "B/voxel"},
};

/// Times a pair with warm kernels, after a check that the result is that of the public estimation.
PairRun timed(const MotionBench& bench, WarmPair& pair, const Volume& fixed, const Volume& moving) {
  demand_same_as_public(bench.context, pair.run(fixed, moving), fixed, moving, pair.plan().options);
  // The paper's method takes tens of times as long on a CPU, so it runs once.
  const bool classic = pair.plan().options.method == MotionMethod::kClassic;
  std::vector<PairRun> runs;
  for (int k = 0; k < (classic ? 1 : bench.runs); ++k) runs.push_back(pair.run(fixed, moving));
  return median_run(std::move(runs));
}

std::vector<Cell> phantom_row(const std::string& what, const Grid& grid, const std::string& method,
                              const Score& error, size_t folded, double seconds) {
  std::vector<Cell> row = {words(what),
                           words(size_text(grid)),
                           words(method),
                           number(error.mean_voxels, 3),
                           number(error.p95_voxels, 3),
                           number(double(folded), 0),
                           number(seconds, 4)};
  row.resize(kPhantomColumns.size());
  return row;
}

/// A synthetic pair, where it is scored, and its name in the targets.
struct Phantom {
  std::string name;
  Volume fixed, moving;
  Field truth;
  struct Region {
    const char* name;
    const char* target;
    Mask mask;
    bool must_gain;  ///< its error must be smaller than without motion
  };
  std::vector<Region> regions;
};

Phantom heart(bool quick) {
  Sequence beating = shell_phantom(quick ? 64 : 128);
  const Grid grid = beating.frames[0].grid;
  return {"heart",
          std::move(beating.frames[0]),
          std::move(beating.frames[1]),
          shell_truth(grid, 0, 1),
          {{"shell", "heart", shell_mask(grid, 0), true}}};
}

Phantom sliding(bool quick) {
  SlidingPhantom slide = quick ? sliding_phantom(48, 10.0) : sliding_phantom();
  return {"sliding",
          std::move(slide.fixed),
          std::move(slide.moving),
          std::move(slide.truth),
          {{"organ", "organ", std::move(slide.organ), true},
           {"wall", "wall", std::move(slide.wall), false}}};
}

void add_presets(MotionBench& bench, const Phantom& phantom, Table& table) {
  const Grid& grid = phantom.fixed.grid;
  for (const std::string_view preset : kMotionPresets) {
    const std::string name(preset);
    bench.context->reset_memory_peak();
    WarmPair pair(bench.context, grid, *motion_preset(preset));
    pair.run(phantom.fixed, phantom.moving);
    const double bytes = double(bench.context->memory_peak_bytes()) / double(grid.count());
    const PairRun run = timed(bench, pair, phantom.fixed, phantom.moving);
    const size_t folded = folds(resampled(run.field, grid)).folded;
    bench.found["folds"][name] += double(folded);
    for (const Phantom::Region& region : phantom.regions) {
      const Score error = score(run.field, phantom.truth, region.mask, phantom.name + ", " + name,
                                region.must_gain);
      bench.found[region.target][name] = error.mean_voxels;
      auto row =
          phantom_row(phantom.name + ", " + region.name, grid, name, error, folded, run.total_s());
      row[7] = number(run.convert_s, 4);
      row[8] = number(run.prepare_s, 4);
      row[9] = number(run.solve_s, 4);
      row[10] = number(run.download_s, 4);
      row[11] = number(bytes, 1);
      table.rows.push_back(std::move(row));
    }
  }
}

/// Peers run once. Whether they are better than no motion is a finding.
void add_peers(MotionBench& bench, const Phantom& phantom, Table& table) {
  for (const auto& peer : bench.peers()) {
    const auto result = peer->run(phantom.fixed, phantom.moving);
    if (!result) throw Mismatch(peer->name() + ": " + result.error().message);
    const size_t folded = folds(result->field).folded;
    for (const Phantom::Region& region : phantom.regions) {
      const Score error = score(result->field, phantom.truth, region.mask, peer->name(), false);
      double& best =
          bench.found[region.target].try_emplace("peer", error.mean_voxels).first->second;
      best = std::min(best, error.mean_voxels);
      table.rows.push_back(phantom_row(phantom.name + ", " + region.name, phantom.fixed.grid,
                                       peer->name(), error, folded, result->seconds));
    }
  }
}

double iterations_done(const SolveReport& report, bool all) {
  double sum = 0.0;
  for (const LevelReport& level : report.levels)
    sum += all ? level.all_brick_iterations : level.brick_iterations;
  return sum;
}

}  // namespace

std::string size_text(const Grid& grid) {
  return fmt::format("{} x {} x {}", grid.size.x, grid.size.y, grid.size.z);
}

Score score(const Field& field, const Field& truth, const Mask& mask, const std::string& what,
            bool better) {
  const auto error = endpoint_error(field, truth, &mask);
  const auto still = endpoint_error(still_field(truth.grid), truth, &mask);
  if (!error || !still) throw Mismatch(what + ": " + (error ? still : error).error().message);
  if (better && !(error->voxels.mean < still->voxels.mean)) {
    throw Mismatch(
        fmt::format("{}: the field's error of {:.3f} voxels is no better than no "
                    "motion's ({:.3f}), so its time means nothing.",
                    what, error->voxels.mean, still->voxels.mean));
  }
  return {error->voxels.mean, error->voxels.p95};
}

Table phantom_table(MotionBench& bench) {
  Table table;
  table.title = "Synthetic pairs: beating heart, organ that slides past a still wall";
  table.note =
      "Endpoint error in voxels: on the heart's wall; in the organ, and in the wall within 5 "
      "voxels "
      "of the border. Seconds of one pair, kernels warm: convert (both frames to fp16), prepare "
      "(upload, pyramid), solve, download; classic and peers once. Folds at image resolution. "
      "B/voxel: peak device memory by voxels of one frame.";
  table.columns = kPhantomColumns;
  for (const Phantom& phantom : {heart(bench.quick), sliding(bench.quick)}) {
    add_presets(bench, phantom, table);
    add_peers(bench, phantom, table);
  }
  return table;
}

Table resting_table(const MotionBench& bench) {
  Table table;
  table.title = "What resting bricks save";
  table.note =
      "Heart phantom, the same preset with all bricks computed in every iteration and with those "
      "left out that do not move or show nothing.";
  table.columns = {{"preset", "preset"},
                   {"bricks", "bricks"},
                   {"brick_iterations", "brick iterations"},
                   {"share", "share"},
                   {"error_mean_voxels", "error"},
                   {"solve_s", "solve s"},
                   {"saved_share", "time saved"}};
  const Sequence heart = shell_phantom(bench.quick ? 64 : 128);
  const Grid& grid = heart.frames[0].grid;
  const Field truth = shell_truth(grid, 0, 1);
  const Mask shell = shell_mask(grid, 0);
  for (const char* preset : {"fast", "balanced", "best"}) {
    double all_s = 0.0;
    for (const bool rest : {false, true}) {
      MotionOptions options = *motion_preset(preset);
      if (!rest) options.converged = options.structure = 0.0;
      WarmPair pair(bench.context, grid, options);
      const PairRun run = timed(bench, pair, heart.frames[0], heart.frames[1]);
      if (!rest) all_s = run.solve_s;
      const Score error = score(run.field, truth, shell, preset);
      const double done = iterations_done(run.report, false);
      table.rows.push_back({words(preset), words(rest ? "may rest" : "all"), number(done, 0),
                            number(done / iterations_done(run.report, true), 2),
                            number(error.mean_voxels, 3), number(run.solve_s, 4),
                            rest ? number(1.0 - run.solve_s / all_s, 2) : nothing()});
    }
  }
  return table;
}

Table classic_table(MotionBench& bench) {
  constexpr int kIterations = 25;
  const Sequence beating = shell_phantom(bench.quick ? 64 : 128);
  const Grid& grid = beating.frames[0].grid;
  MotionOptions options = *motion_preset("classic");
  options.coarse_levels = 1;
  options.levels = {{kIterations, 1}};
  WarmPair pair(bench.context, grid, options);
  const PairRun first = pair.run(beating.frames[0], beating.frames[1]);
  demand_same_as_public(bench.context, first, beating.frames[0], beating.frames[1], options);
  score(first.field, shell_truth(grid, 0, 1), shell_mask(grid, 0), "classic");
  // Alternating, so that a disturbance affects both equally.
  std::vector<double> ours, itks;
  for (int run = 0; run < bench.runs; ++run) {
    ours.push_back(pair.run(beating.frames[0], beating.frames[1]).report.levels.at(0).seconds /
                   kIterations);
    if (!bench.demons_iteration_s) continue;
    const auto itk = bench.demons_iteration_s(grid.size.x);
    if (!itk) throw Mismatch(itk.error().message);
    itks.push_back(*itk);
  }
  Table table;
  table.title = "classic against ITK's Demons, per iteration";
  table.note = fmt::format(
      "The paper's equation (34) on one level of {}, every voxel computed, Gauss of one voxel; "
      "medians of {} by turns.",
      size_text(grid), bench.runs);
  table.columns = {{"method", "method"},
                   {"iteration_s", "s per iteration"},
                   {"voxel_iterations_per_s", "million voxel-iterations/s"},
                   {"times", "times ITK"}};
  const double itk_s = itks.empty() ? 0.0 : median(itks);
  const auto add = [&](const char* who, double each_s) {
    const double rate = double(grid.count()) / each_s;
    table.rows.push_back({words(who),
                          number(each_s, 5),
                          {fmt::format("{:.1f}", 1e-6 * rate), rate},
                          itk_s > 0.0 ? number(itk_s / each_s, 2) : nothing()});
  };
  add("palpate classic", median(ours));
  if (itk_s == 0.0) return table;
  add("ITK DemonsRegistrationFilter", itk_s);
  bench.found["classic rate"]["classic"] = itk_s / median(ours);
  return table;
}

}  // namespace palpate::bench
