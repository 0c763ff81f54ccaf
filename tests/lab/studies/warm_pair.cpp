#include "tests/lab/studies/warm_pair.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "compute/motion/classic.h"
#include "compute/motion/estimator.h"

namespace palpate::studies {
namespace {

// The device computes the same sums in the same order in both, so the fields are equal; but drivers
// may choose other instructions for a second pipeline of the same shader.
constexpr double kSameVoxels = 1e-3;

/// Cut into slabs as the estimator does.
MotionPlan fitting_plan(const vulkan::Context& context, const Grid& grid,
                        const MotionOptions& options) {
  MotionPlan plan = plan_motion(grid, options);
  if (!fit_into(plan, budget_of(context)))
    throw Mismatch("The device has too little memory for this pair: choose another with --gpu.");
  return plan;
}

}  // namespace

WarmPair::WarmPair(std::shared_ptr<vulkan::Context> context, const Grid& grid,
                   const MotionOptions& options)
    : context_(std::move(context)),
      plan_(fitting_plan(*context_, grid, options)),
      kernels_(std::make_shared<MotionKernels>(context_)),
      builder_(context_, kernels_, plan_, whole_region(plan_)),
      fixed_(context_, plan_),
      moving_(context_, plan_) {
  if (options.method == MotionMethod::kClassic) {
    solver_ = std::make_unique<ClassicSolver>(context_, kernels_, plan_);
  } else {
    solver_ = std::make_unique<PairSolver>(context_, kernels_, plan_, whole_region(plan_));
  }
}

std::optional<PairRun> WarmPair::run(const Volume& fixed, const Volume& moving,
                                     const std::stop_token& stop) {
  PairRun run;
  const double begin = now_s();
  const auto [scale, noise] = frame_scale(fixed, plan_.options.noise);
  fixed_values_ = scaled_halves(fixed, scale, std::move(fixed_values_));
  moving_values_ = scaled_halves(moving, scale, std::move(moving_values_));
  const double converted = now_s();
  builder_.build(fixed_values_, noise, fixed_);
  builder_.build(moving_values_, noise, moving_);
  const double prepared = now_s();
  auto report = solver_->solve(fixed_, moving_, stop, {});
  if (!report) return std::nullopt;
  run.report = std::move(*report);
  const double solved = now_s();
  solver_->download(run.field, run.confidence);
  run.convert_s = converted - begin;
  run.prepare_s = prepared - converted;
  run.solve_s = solved - prepared;
  run.download_s = now_s() - solved;
  return run;
}

PairRun median_run(std::vector<PairRun> runs) {
  const auto middle = runs.begin() + std::ptrdiff_t((runs.size() - 1) / 2);
  std::nth_element(runs.begin(), middle, runs.end(),
                   [](const PairRun& a, const PairRun& b) { return a.total_s() < b.total_s(); });
  return std::move(*middle);
}

double largest_difference_voxels(const Field& a, const Field& b, const Grid& image) {
  if (!same_geometry(a.grid, b.grid)) return std::numeric_limits<double>::infinity();
  double largest = 0.0;
  for (size_t i = 0; i < a.u_mm.size(); ++i) {
    const double apart = double(glm::length(a.u_mm[i] - b.u_mm[i]));
    if (std::isnan(apart)) return apart;
    largest = std::max(largest, apart);
  }
  return largest / image.finest_mm();
}

void demand_same_as_public(const std::shared_ptr<vulkan::Context>& context, const PairRun& run,
                           const Volume& fixed, const Volume& moving, const MotionOptions& options,
                           const std::stop_token& stop) {
  EstimatorOptions whole;
  whole.motion = options;
  const Result<PairMotion> motion = estimate_motion(context, fixed, moving, whole, stop);
  if (stop.stop_requested()) return;
  if (!motion) throw Mismatch(motion.error().message);
  const double apart = largest_difference_voxels(run.field, motion->field, fixed.grid);
  if (!(apart <= kSameVoxels)) {
    throw Mismatch("The field that was timed (" + options.preset + ") is " + std::to_string(apart) +
                   " voxels from estimate_motion()'s: bring warm_pair.cpp in line with "
                   "estimator.cpp.");
  }
}

}  // namespace palpate::studies
