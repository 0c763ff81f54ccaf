#include "tests/lab/bench/motion_bench_cases.h"

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
    {"preset", "preset"},
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

/// Times a pair with warm kernels after checking that it is the public estimation.
PairRun timed(const Bench& bench, WarmPair& pair, const Volume& fixed, const Volume& moving) {
  demand_same_as_public(bench.context, pair.run(fixed, moving), fixed, moving, pair.plan().options);
  // The paper's method takes tens of times as long on a CPU: once must do.
  const bool classic = pair.plan().options.method == MotionMethod::kClassic;
  std::vector<PairRun> runs;
  for (int k = 0; k < (classic ? 1 : bench.runs); ++k) runs.push_back(pair.run(fixed, moving));
  return median_run(std::move(runs));
}

std::vector<Cell> phantom_row(const std::string& what, const Grid& grid, const std::string& preset,
                              const Score& error, const PairRun& run, size_t folded,
                              double bytes_per_voxel) {
  return {words(what),
          words(size_text(grid)),
          words(preset),
          number(error.mean_voxels, 3),
          number(error.p95_voxels, 3),
          number(double(folded), 0),
          number(run.total_s(), 4),
          number(run.convert_s, 4),
          number(run.prepare_s, 4),
          number(run.solve_s, 4),
          number(run.download_s, 4),
          number(bytes_per_voxel, 1)};
}

double peak_per_voxel(const Bench& bench, const Grid& grid) {
  return double(bench.context->memory_peak_bytes()) / double(grid.count());
}

void add_heart(const Bench& bench, Table& table) {
  const Sequence heart = shell_phantom(bench.quick ? 64 : 128);
  const Grid& grid = heart.frames[0].grid;
  const Field truth = shell_truth(grid, 0, 1);
  const Mask shell = shell_mask(grid, 0);
  for (const std::string_view preset : kMotionPresets) {
    bench.context->reset_memory_peak();
    WarmPair pair(bench.context, grid, *motion_preset(preset));
    pair.run(heart.frames[0], heart.frames[1]);
    const double bytes = peak_per_voxel(bench, grid);
    const PairRun run = timed(bench, pair, heart.frames[0], heart.frames[1]);
    const Score error = score(run.field, truth, shell, "heart, " + std::string(preset));
    const size_t folded = folds(resampled(run.field, grid)).folded;
    table.rows.push_back(
        phantom_row("heart, shell", grid, std::string(preset), error, run, folded, bytes));
  }
}

void add_sliding(const Bench& bench, Table& table) {
  const SlidingPhantom slide = bench.quick ? sliding_phantom(48, 10.0) : sliding_phantom();
  const Grid& grid = slide.fixed.grid;
  for (const std::string_view preset : kMotionPresets) {
    bench.context->reset_memory_peak();
    WarmPair pair(bench.context, grid, *motion_preset(preset));
    pair.run(slide.fixed, slide.moving);
    const double bytes = peak_per_voxel(bench, grid);
    const PairRun run = timed(bench, pair, slide.fixed, slide.moving);
    const std::string name = "sliding, " + std::string(preset);
    const Score organ = score(run.field, slide.truth, slide.organ, name);
    const Score wall = score(run.field, slide.truth, slide.wall, name, false);
    const size_t folded = folds(resampled(run.field, grid)).folded;
    for (const auto& [region, error] : {std::pair("organ", organ), std::pair("wall", wall)}) {
      table.rows.push_back(phantom_row(fmt::format("sliding, {}", region), grid,
                                       std::string(preset), error, run, folded, bytes));
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

Table phantom_table(const Bench& bench) {
  Table table;
  table.title = "Made pairs whose motion is known";
  table.note =
      "Endpoint error in voxels. Seconds of one pair, kernels warm: convert (both frames to fp16), "
      "prepare (upload, pyramid), solve, download; classic once. Folds at image resolution. "
      "B/voxel: peak device "
      "memory by voxels of one frame.";
  table.columns = kPhantomColumns;
  add_heart(bench, table);
  add_sliding(bench, table);
  return table;
}

Table resting_table(const Bench& bench) {
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

Table classic_table(const Bench& bench) {
  constexpr int kIterations = 25;
  Table table;
  table.title = "classic, per iteration";
  table.note = "The paper's equation (34) on one level, every voxel computed, Gauss of one voxel.";
  table.columns = {{"grid", "grid"},
                   {"iterations", "iterations"},
                   {"error_mean_voxels", "error"},
                   {"iteration_s", "s per iteration"},
                   {"voxel_iterations_per_s", "voxel-iterations/s"}};
  const Sequence heart = shell_phantom(bench.quick ? 64 : 128);
  const Grid& grid = heart.frames[0].grid;
  MotionOptions options = *motion_preset("classic");
  options.coarse_levels = 1;
  options.levels = {{kIterations, 1}};
  WarmPair pair(bench.context, grid, options);
  const PairRun run = timed(bench, pair, heart.frames[0], heart.frames[1]);
  const Score error = score(run.field, shell_truth(grid, 0, 1), shell_mask(grid, 0), "classic");
  const double each_s = run.report.levels.at(0).seconds / kIterations;
  table.rows.push_back({words(size_text(grid)), number(kIterations, 0),
                        number(error.mean_voxels, 3), number(each_s, 5),
                        number(double(grid.count()) / each_s, 0)});
  return table;
}

}  // namespace palpate::bench
