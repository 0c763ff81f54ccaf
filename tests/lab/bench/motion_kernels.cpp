#include "tests/lab/bench/motion_kernels.h"

#include <algorithm>

#include <fmt/format.h>

#include "compute/motion/discrete_start.h"
#include "compute/motion/options.h"
#include "compute/volume/phantom.h"
#include "tests/lab/bench/motion_steps.h"

namespace palpate::bench {
namespace {

// Of a step between two time stamps: else the stamp's own time is larger than a short step's.
constexpr int kRepeats = 5;

/// The time of a step over all levels; bytes 0: unknown.
struct Total {
  std::string name;
  double seconds = 0.0, bytes = 0.0, calls = 0.0;
};

/// Seconds of one call of each step: device time between stamps, median over runs.
std::vector<double> seconds_of(const MotionBench& bench, const std::vector<Step>& steps) {
  int dispatches = 0;
  for (const Step& step : steps) dispatches += step.dispatches * kRepeats;
  vulkan::Recorder recorder(bench.context, uint32_t(dispatches + 1));
  recorder.stamp("begin");
  for (const Step& step : steps) {
    for (int k = 0; k < kRepeats; ++k) step.record(recorder);
    recorder.stamp(step.name);
  }
  // Compiles and warms up.
  recorder.run();
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

/// Bytes read and written per second by a plain copy that is larger than any cache: the bandwidth
/// of the device's memory, with which the kernels are compared.
double copy_rate(const MotionBench& bench) {
  constexpr uint64_t kBytes = 128U << 20;
  vulkan::Buffer from(bench.context, kBytes), to(bench.context, kBytes);
  vulkan::Recorder recorder(bench.context);
  recorder.fill(from, 1);
  recorder.stamp("begin");
  for (int k = 0; k < kRepeats; ++k) recorder.copy(from, to, kBytes);
  recorder.stamp("end");
  recorder.run();
  std::vector<double> samples;
  for (int run = 0; run < bench.runs; ++run) {
    recorder.run();
    samples.push_back(recorder.timestamps().back().seconds / kRepeats);
  }
  return 2.0 * double(kBytes) / median(samples);
}

/// The report of a level of the plan; levels are reported coarsest first, down to the finest.
const LevelReport* report_of(const SolveReport& report, const MotionPlan& plan, size_t level) {
  const size_t finest = size_t(plan.options.finest_level);
  if (level < finest || level - finest >= report.levels.size()) return nullptr;
  return &report.levels[report.levels.size() - 1 - (level - finest)];
}

/// Every step of a pair, summed over the levels, in the order of execution.
std::vector<Total> totals_of(const MotionBench& bench, WarmPair& pair, const SolveReport& report) {
  std::vector<Total> totals;
  for (size_t l = 0; l < pair.plan().levels.size(); ++l) {
    const LevelSteps level(bench.context, pair, l, report_of(report, pair.plan(), l));
    const std::vector<double> seconds = seconds_of(bench, level.steps());
    for (size_t s = 0; s < seconds.size(); ++s) {
      const Step& step = level.steps()[s];
      auto total = std::find_if(totals.begin(), totals.end(),
                                [&](const Total& t) { return t.name == step.name; });
      if (total == totals.end()) total = totals.insert(totals.end(), Total{step.name});
      total->seconds += seconds[s] * step.calls;
      total->bytes += step.bytes * step.calls;
      total->calls += step.calls;
    }
  }
  double search_s = 0.0;
  for (const LevelReport& level : report.levels) search_s += level.search_seconds;
  totals.push_back({"discrete start (host's clock)", search_s, 0, 1});
  return totals;
}

Cell scaled(double value, double by, int digits) {
  return {fmt::format("{:.{}f}", by * value, digits), value};
}

std::vector<Cell> step_row(const Total& t, double whole_s, double copy_bytes_per_s) {
  const bool told = t.bytes > 0.0;
  return {words(t.name),
          number(t.calls, 1),
          scaled(t.seconds, 1e3, 2),
          told ? scaled(t.bytes, 1e-6, 1) : nothing(),
          told ? scaled(t.bytes / t.seconds, 1e-9, 1) : nothing(),
          told ? scaled(t.bytes / t.seconds / copy_bytes_per_s, 1e2, 0) : nothing(),
          scaled(t.seconds / whole_s, 1e2, 1)};
}

}  // namespace

Table kernel_table(const MotionBench& bench, const std::string& preset) {
  if (!bench.context->limits().timestampComputeAndGraphics)
    throw Mismatch("This device has no time stamps for compute work: choose another (--gpu).");
  const Sequence heart = shell_phantom(bench.quick ? 64 : 128);
  const Volume &fixed = heart.frames[0], &moving = heart.frames[1];
  WarmPair pair(bench.context, fixed.grid, *motion_preset(preset));
  demand_same_as_public(bench.context, pair.run(fixed, moving), fixed, moving, pair.plan().options);
  std::vector<PairRun> runs;
  for (int k = 0; k < bench.runs; ++k) runs.push_back(pair.run(fixed, moving));
  const PairRun run = median_run(std::move(runs));
  const double whole_s = run.prepare_s + run.solve_s;
  const double copy_bytes_per_s = copy_rate(bench);

  Table table;
  table.title =
      fmt::format("Where the time of a pair goes ({}, {})", preset, size_text(fixed.grid));
  table.note = fmt::format(
      "Device time of each step run alone, over all levels and as often as one pair needs it; "
      "bytes: every input and output once. A copy between buffers moves {:.1f} GB/s. Shares are of "
      "prepare + solve, {:.1f} ms on the host's clock.",
      1e-9 * copy_bytes_per_s, 1e3 * whole_s);
  table.columns = {{"step", "step"},       {"calls", "calls"},      {"pair_s", "ms a pair"},
                   {"bytes", "MB a pair"}, {"bytes_per_s", "GB/s"}, {"of_copy", "% of a copy's"},
                   {"share", "share %"}};
  double rest_s = whole_s;
  for (const Total& total : totals_of(bench, pair, run.report)) {
    table.rows.push_back(step_row(total, whole_s, copy_bytes_per_s));
    rest_s -= total.seconds;
  }
  const Total rest{"all else: submitting, level starts, repair, confidence", rest_s, 0, 1};
  table.rows.push_back(step_row(rest, whole_s, copy_bytes_per_s));
  return table;
}

}  // namespace palpate::bench
