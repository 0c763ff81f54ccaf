#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>

#include "compute/motion/options.h"
#include "compute/motion/plan.h"
#include "compute/motion/report.h"
#include "compute/volume/result.h"
#include "compute/volume/sequence.h"

namespace palpate::vulkan {
class Context;
}

namespace palpate {

/// The motion of one pair of frames: field, confidence, and what it cost.
struct PairMotion {
  size_t fixed_frame = 0;  ///< index of the fixed frame as pushed
  size_t moving_frame = 0;
  Field field;  ///< on MotionPlan::field; mm, LPS; fixed x -> x + u(x) in moving
  /// On the same grid; its deviation is on a coarser one where the field is on finer cells than
  /// were solved (SlidingOptions::cell), and not known to the classic engine.
  Confidence confidence;
  SolveReport report;
  /// Field from moving to fixed, if EstimatorOptions::backward: estimated on its own from the
  /// second finest level up, with few iterations.
  std::optional<Field> backward;
};

/// Memory that the work will take, known before it starts.
struct MemoryEstimate {
  uint64_t device_bytes = 0;  ///< peak on the device
  uint64_t budget_bytes = 0;  ///< device memory that may be used
  int slabs = 1;              ///< pieces into which the finest images are cut so that they fit
  bool backward = false;      ///< the field from moving to fixed fits (if it was asked for)
  bool sliding = false;       ///< the step for sliding borders fits (if it was asked for)
};

/// What the device of a context has for one estimation, and its machine. On a driver for CPUs both
/// are the same memory, and a third of what is free stays for frames and fields.
MemoryBudget budget_of(const vulkan::Context& context);

struct EstimatorOptions {
  MotionOptions motion;
  bool cyclic = false;  ///< after finish(), also last frame -> first
  /// Pairs lead from the first frame to each other one, not from each to the next; not cyclic then.
  bool from_first = false;
  bool backward = false;  ///< also a quick field from moving to fixed, for examined(), if it fits
  /// on the frames' grid, for every fixed frame; voxels outside do not count
  std::optional<Mask> mask;
  /// Frames that may wait. With more the oldest waiting one is dropped, so that a live source does
  /// not fall behind. 0: never drop; push() blocks while two frames wait.
  size_t backlog = 0;
};

/// Estimates fields while frames arrive. Reading (by the caller), conversion (in push), device work
/// and delivery (on a worker thread) overlap. Frames come in rising order of index; a pair is two
/// frames that follow each other among those that were not dropped, or the first one and another
/// (EstimatorOptions::from_first).
///
///   auto estimator = SequenceEstimator::open(context, grid, options, on_motion, on_progress);
///   for (...) estimator->push(k, frame);
///   Status done = estimator->finish();
///
/// push, finish and cancel may be called from any thread. The callbacks are called on the worker
/// thread, one at a time, and must not call finish(). An exception from them ends the work:
/// finish() returns it as an error.
class SequenceEstimator {
 public:
  using OnMotion = std::function<void(PairMotion)>;
  /// The pair being solved, and its share that is done, 0 to 1.
  using OnProgress = std::function<void(size_t fixed_frame, size_t moving_frame, double share)>;

  /// Plans for frames on `grid`. Errors: kOutOfMemory if even slabs do not fit, kBadInput if the
  /// options are out of range.
  static Result<std::unique_ptr<SequenceEstimator>> open(std::shared_ptr<vulkan::Context> context,
                                                         const Grid& grid, EstimatorOptions options,
                                                         OnMotion on_motion,
                                                         OnProgress on_progress = {});
  virtual ~SequenceEstimator() = default;  ///< cancels running work

  virtual const MotionPlan& plan() const = 0;
  virtual MemoryEstimate memory() const = 0;

  /// Takes a frame. Errors: kBadInput: another grid, or an index not above the previous one;
  /// kCancelled: after cancel() or finish(); kDeviceFailed: the worker has failed.
  virtual Status push(size_t frame_index, const Volume& frame) = 0;

  /// Ends the input: waits until every field has been delivered and returns the first error, if
  /// any.
  virtual Status finish() = 0;

  /// Stops as soon as the device has finished its current batch. After a running callback has
  /// returned nothing more is delivered. finish() then returns kCancelled.
  virtual void cancel() = 0;

  /// Frames dropped so far in favour of newer ones.
  virtual size_t dropped() const = 0;
};

/// Estimates one pair and waits. The moving frame is resampled onto the fixed frame's grid if they
/// differ. Any thread.
Result<PairMotion> estimate_motion(const std::shared_ptr<vulkan::Context>& context,
                                   const Volume& fixed, const Volume& moving,
                                   const EstimatorOptions& options, std::stop_token stop = {},
                                   const std::function<void(double)>& progress = {});

}  // namespace palpate
