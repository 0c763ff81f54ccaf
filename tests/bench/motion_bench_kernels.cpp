#include "tests/bench/motion_bench_kernels.h"

#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "compute/motion/discrete_start.h"
#include "compute/motion/options.h"
#include "compute/volume/phantom.h"
#include "tests/bench/motion_bench_steps.h"

namespace palpate::bench {
namespace {

constexpr int kRepeats =
    5;  // of a step between two stamps: short ones drown in the stamp otherwise

/// What a step costs over all levels.
struct Total {
  size_t first_seen = 0;  // keeps the order in which the engine runs the steps
  double seconds = 0.0, bytes = 0.0, calls = 0.0;
};

/// Seconds of one call of each step: device time between stamps, median over runs.
std::vector<double> seconds_of(const Bench& bench, const std::vector<Step>& steps) {
  int dispatches = 0;
  for (const Step& step : steps) dispatches += step.dispatches * kRepeats;
  vulkan::Recorder recorder(bench.context, uint32_t(dispatches + 1));
  recorder.stamp("begin");
  for (const Step& step : steps) {
    for (int k = 0; k < kRepeats; ++k) step.record(recorder);
    recorder.stamp(step.name);
  }
  recorder.run();  // compiles and warms up
  std::vector<std::vector<double>> samples(steps.size());
  for (int run = 0; run < bench.runs; ++run) {
    recorder.run();
    const auto stamps = recorder.timestamps();
    for (size_t s = 0; s < steps.size(); ++s)
      samples[s].push_back((stamps[s + 1].seconds - stamps[s].seconds) / kRepeats);
  }
  std::vector<double> result;
  for (const auto& sample : samples) result.push_back(median(sample));
  return result;
}

double discrete_start_s(const Bench& bench, WarmPair& pair, const SearchPlan& search) {
  DiscreteStart start(bench.context, pair.kernels(), pair.plan(), search);
  std::vector<double> samples;
  for (int k = 0; k <= bench.runs; ++k) {
    const double begin = now_s();
    start.solve(pair.fixed(), pair.moving());
    if (k > 0) samples.push_back(now_s() - begin);
  }
  return median(samples);
}

/// The report of a level of the plan; levels are reported coarsest first, down to the finest.
const LevelReport* report_of(const SolveReport& report, const MotionPlan& plan, size_t level) {
  const size_t finest = size_t(plan.options.finest_level);
  if (level < finest || level - finest >= report.levels.size()) return nullptr;
  return &report.levels[report.levels.size() - 1 - (level - finest)];
}

}  // namespace

Table kernel_table(const Bench& bench, const std::string& preset) {
  if (!bench.context->limits().timestampComputeAndGraphics)
    throw Mismatch("This device has no time stamps for compute work: leave the kernels out.");
  const Sequence heart = heart_phantom(bench.quick ? 64 : 128);
  const Grid& grid = heart.frames[0].grid;
  WarmPair pair(bench.context, grid, *motion_preset(preset));
  demand_same_as_public(bench.context, pair.run(heart.frames[0], heart.frames[1]), heart.frames[0],
                        heart.frames[1], pair.plan().options);
  std::vector<PairRun> runs;
  for (int k = 0; k < bench.runs; ++k) runs.push_back(pair.run(heart.frames[0], heart.frames[1]));
  const PairRun run = median_run(std::move(runs));
  const double whole_s = run.prepare_s + run.solve_s;

  std::map<std::string, Total> totals;
  std::vector<std::string> order;
  const auto add = [&](const std::string& name, double seconds, double bytes, double calls) {
    if (!totals.contains(name)) order.push_back(name);
    Total& total = totals[name];
    total.seconds += seconds * calls;
    total.bytes += bytes * calls;
    total.calls += calls;
  };
  for (size_t l = 0; l < pair.plan().levels.size(); ++l) {
    const LevelSteps level(bench.context, pair, l, report_of(run.report, pair.plan(), l));
    const std::vector<double> seconds = seconds_of(bench, level.steps());
    for (size_t s = 0; s < seconds.size(); ++s) {
      const Step& step = level.steps()[s];
      add(step.name, seconds[s], step.bytes, step.calls);
    }
  }

  Table table;
  table.title = fmt::format("Where the time of a pair goes ({}, {})", preset, size_text(grid));
  table.note = fmt::format(
      "Device time of each step run alone, over all levels and as often as one pair needs it; "
      "bytes: every input and output once. Shares are of prepare + solve, {:.1f} ms on the host's "
      "clock.",
      1e3 * whole_s);
  table.columns = {{"step", "step"},       {"calls", "calls"},      {"pair_s", "ms a pair"},
                   {"bytes", "MB a pair"}, {"bytes_per_s", "GB/s"}, {"share", "share %"}};
  double sum = 0.0;
  for (const std::string& name : order) {
    const Total& t = totals[name];
    sum += t.seconds;
    table.rows.push_back({words(name),
                          number(t.calls, 1),
                          {fmt::format("{:.2f}", 1e3 * t.seconds), t.seconds},
                          {fmt::format("{:.1f}", 1e-6 * t.bytes), t.bytes},
                          {fmt::format("{:.1f}", 1e-9 * t.bytes / t.seconds), t.bytes / t.seconds},
                          {fmt::format("{:.1f}", 1e2 * t.seconds / whole_s), t.seconds / whole_s}});
  }
  const auto add_row = [&](const char* name, double calls, double seconds) {
    table.rows.push_back({words(name),
                          number(calls, 0),
                          {fmt::format("{:.2f}", 1e3 * seconds), seconds},
                          nothing(),
                          nothing(),
                          {fmt::format("{:.1f}", 1e2 * seconds / whole_s), seconds / whole_s}});
  };
  if (const auto search = plan_search(pair.plan())) {
    const double start_s = discrete_start_s(bench, pair, *search);
    sum += start_s;
    add_row("discrete start (host's clock)", 1, start_s);
  }
  add_row("all else: submitting, level starts, repair, confidence", 1, whole_s - sum);
  return table;
}

}  // namespace palpate::bench
