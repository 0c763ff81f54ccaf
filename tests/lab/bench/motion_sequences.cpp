#include <cmath>

#include <fmt/format.h>

#include "compute/motion/estimator.h"
#include "compute/motion/quality.h"
#include "compute/volume/phantom.h"
#include "tests/lab/bench/motion_tables.h"
#include "tests/lab/bench/tools.h"
#include "tests/lab/studies/warm_pair.h"

namespace palpate::bench {
namespace {

const std::vector<Column> kColumns = {
    {"case", "case"},       {"grid", "grid"},
    {"preset", "preset"},   {"error_mean_voxels", "error"},
    {"fields", "fields"},   {"open_s", "open s"},
    {"whole_s", "whole s"}, {"field_s", "s per field"},
    {"solve_s", "solve"},   {"device_bytes_per_voxel", "B/voxel"},
};

/// One whole cycle: the frames are in host memory at the start, the fields at the end.
struct CycleRun {
  std::vector<PairMotion> motions;
  double open_s = 0.0;
  double whole_s = 0.0;
};

CycleRun cycle(const MotionBench& bench, const Sequence& frames, const MotionOptions& motion) {
  CycleRun run;
  EstimatorOptions options;
  options.motion = motion;
  options.cyclic = true;
  const double begin = now_s();
  auto estimator =
      SequenceEstimator::open(bench.context, frames.frames[0].grid, options,
                              [&](PairMotion found) { run.motions.push_back(std::move(found)); });
  if (!estimator) throw Mismatch(estimator.error().message);
  const double opened = now_s();
  for (size_t k = 0; k < frames.frames.size(); ++k) {
    if (const Status pushed = (*estimator)->push(k, frames.frames[k]); !pushed)
      throw Mismatch(pushed.error().message);
  }
  if (const Status done = (*estimator)->finish(); !done) throw Mismatch(done.error().message);
  run.open_s = opened - begin;
  run.whole_s = now_s() - opened;
  if (run.motions.size() != frames.frames.size())
    throw Mismatch(fmt::format("A cycle of {} frames gave {} fields.", frames.frames.size(),
                               run.motions.size()));
  return run;
}

std::vector<Cell> cycle_row(const MotionBench& bench, const Sequence& heart,
                            const std::string& preset) {
  const Grid& grid = heart.frames[0].grid;
  const int frames = int(heart.frames.size());
  bench.context->reset_memory_peak();
  std::vector<CycleRun> runs;
  std::vector<double> whole;
  for (int k = 0; k < bench.runs; ++k) {
    runs.push_back(cycle(bench, heart, *motion_preset(preset)));
    whole.push_back(runs.back().whole_s);
  }
  const double middle = median(whole);
  const CycleRun& run =
      *std::find_if(runs.begin(), runs.end(), [&](const auto& r) { return r.whole_s == middle; });
  const Score error = score(run.motions[0].field, shell_truth(grid, 0, 1, frames),
                            shell_mask(grid, 0, frames), "cycle, " + preset);
  double solve_s = 0.0;
  for (const PairMotion& motion : run.motions) solve_s += motion.report.seconds;
  return {words(fmt::format("{} frames, cyclic", frames)),
          words(size_text(grid)),
          words(preset),
          number(error.mean_voxels, 3),
          number(double(run.motions.size()), 0),
          number(run.open_s, 4),
          number(run.whole_s, 4),
          number(run.whole_s / double(run.motions.size()), 4),
          number(solve_s, 4),
          number(double(bench.context->memory_peak_bytes()) / double(grid.count()), 1)};
}

std::vector<Cell> pair_row(const MotionBench& bench, const Sequence& heart,
                           const std::string& preset) {
  const Grid& grid = heart.frames[0].grid;
  const int frames = int(heart.frames.size());
  bench.context->reset_memory_peak();
  const double begin = now_s();
  WarmPair pair(bench.context, grid, *motion_preset(preset));
  const double open_s = now_s() - begin;
  std::vector<PairRun> runs;
  for (int k = 0; k <= bench.runs; ++k) {
    PairRun run = pair.run(heart.frames[0], heart.frames[1]);
    // The first run compiles.
    if (k > 0) runs.push_back(std::move(run));
  }
  const PairRun run = median_run(std::move(runs));
  const Score error = score(run.field, shell_truth(grid, 0, 1, frames), shell_mask(grid, 0, frames),
                            "pair, " + preset);
  const int slabs = pair.plan().slabs;
  return {words(slabs > 1 ? fmt::format("pair, warm, {} slabs", slabs) : "pair, warm"),
          words(size_text(grid)),
          words(preset),
          number(error.mean_voxels, 3),
          number(1.0, 0),
          number(open_s, 4),
          number(run.total_s(), 4),
          number(run.total_s(), 4),
          number(run.solve_s, 4),
          number(double(bench.context->memory_peak_bytes()) / double(grid.count()), 1)};
}

/// Empty if the work fits into memory, in one piece or in slabs.
std::string why_not(const MotionBench& bench, const Grid& grid, const MotionOptions& options) {
  MotionPlan plan = plan_motion(grid, options);
  const double needed = double(plan.device_bytes);
  const MemoryBudget budget = budget_of(*bench.context);
  if (fit_into(plan, budget)) return {};
  return fmt::format("does not fit: {:.1f} GiB of {:.1f}", needed / double(1ULL << 30),
                     double(budget.device_bytes) / double(1ULL << 30));
}
}  // namespace

Table sequence_table(const MotionBench& bench) {
  Table table;
  table.title = "Sequences, with transfers";
  table.note =
      "Frames in host memory in, fields in host memory out; conversion, upload and solving "
      "overlap. "
      "Every run is a new estimator, so compiling kernels is in `whole` (drivers keep them on "
      "disk).";
  table.columns = kColumns;
  const Sequence heart = shell_phantom(bench.quick ? 64 : 128);
  for (const char* preset : {"fast", "balanced", "best"})
    table.rows.push_back(cycle_row(bench, heart, preset));
  return table;
}

Table large_table(const MotionBench& bench) {
  Table table;
  table.title = "512 x 512 x 400";
  table.note =
      "A beating heart of ten frames in 256 x 256 x 200 mm, 0.5 mm voxels. Pair: kernels warm, "
      "conversion, upload, solving and download one after the other. Cycle: these overlap.";
  table.columns = kColumns;
  Grid grid;
  grid.size = {512, 512, 400};
  grid.spacing_mm = glm::dvec3(0.5);
  grid.origin_mm = -0.5 * grid.spacing_mm * glm::dvec3(grid.size - 1);
  const std::vector<std::string> presets = {"fast", "balanced", "best"};
  std::vector<std::string> fitting;
  for (const std::string& preset : presets) {
    const std::string reason = why_not(bench, grid, *motion_preset(preset));
    if (reason.empty()) {
      fitting.push_back(preset);
      continue;
    }
    std::vector<Cell> row(table.columns.size());
    row[0] = words(reason);
    row[1] = words(size_text(grid));
    row[2] = words(preset);
    table.rows.push_back(row);
  }
  if (fitting.empty()) return table;
  const Sequence heart = shell_phantom(grid, 10);
  for (const std::string& preset : fitting) table.rows.push_back(pair_row(bench, heart, preset));
  for (const std::string& preset : fitting) table.rows.push_back(cycle_row(bench, heart, preset));
  return table;
}

}  // namespace palpate::bench
