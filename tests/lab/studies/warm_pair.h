#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "compute/motion/pyramid.h"
#include "compute/motion/solver.h"
#include "tests/lab/studies/measuring.h"

namespace palpate::studies {

/// The result of one estimation, and the seconds of its parts.
struct PairRun {
  Field field;
  Confidence confidence;
  SolveReport report;
  double convert_s = 0.0;   ///< both frames: percentiles, noise, scaling, fp16
  double prepare_s = 0.0;   ///< both frames: upload, pyramid, local normalisation
  double solve_s = 0.0;     ///< field on the device
  double download_s = 0.0;  ///< field and confidence in host memory
  double total_s() const { return convert_s + prepare_s + solve_s + download_s; }
};

/// The estimation of a pair as estimate_motion() does it, in separate parts so that it can be timed
/// repeatedly with kernels compiled and memory reserved. demand_same_as_public() checks that it is
/// still the same estimation. One thread. Throws vulkan::Failure.
class WarmPair {
 public:
  WarmPair(std::shared_ptr<vulkan::Context> context, const Grid& grid,
           const MotionOptions& options);

  PairRun run(const Volume& fixed, const Volume& moving) { return *run(fixed, moving, {}); }
  /// Nothing if stopped.
  std::optional<PairRun> run(const Volume& fixed, const Volume& moving,
                             const std::stop_token& stop);

  const MotionPlan& plan() const { return plan_; }
  const std::shared_ptr<MotionKernels>& kernels() const { return kernels_; }
  const FramePyramid& fixed() const { return fixed_; }
  const FramePyramid& moving() const { return moving_; }

 private:
  std::shared_ptr<vulkan::Context> context_;
  MotionPlan plan_;
  std::shared_ptr<MotionKernels> kernels_;
  PyramidBuilder builder_;
  FramePyramid fixed_, moving_;
  HalfVolume fixed_values_, moving_values_;
  std::unique_ptr<FieldSolver> solver_;
};

/// The run with the median total. Needs at least one.
PairRun median_run(std::vector<PairRun> runs);

/// Largest |a - b| between two fields on one grid, in h (the finest voxel edge of `image`);
/// infinity if the grids differ, NaN if a vector is NaN.
double largest_difference_voxels(const Field& a, const Field& b, const Grid& image);

/// Throws Mismatch unless `run` is the result of estimate_motion() for the same frames: a benchmark
/// of something else would mean nothing. Does nothing if stopped.
void demand_same_as_public(const std::shared_ptr<vulkan::Context>& context, const PairRun& run,
                           const Volume& fixed, const Volume& moving, const MotionOptions& options,
                           const std::stop_token& stop = {});

}  // namespace palpate::studies
