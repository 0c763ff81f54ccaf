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

/// The motion of one pair of frames, whole: what was found, how far to trust it, and what it cost.
struct PairMotion {
  size_t fixed_frame = 0;  ///< index of the fixed frame as pushed
  size_t moving_frame = 0;
  Field field;            ///< on MotionPlan::field; mm, LPS; fixed x -> x + u(x) in moving
  Confidence confidence;  ///< on the same grid
  SolveReport report;
  /// Moving to fixed, if EstimatorOptions::backward: estimated on its own from the second finest
  /// level up, with little effort.
  std::optional<Field> backward;
};

/// What the work will take, in words' numbers, before it starts.
struct MemoryEstimate {
  uint64_t device_bytes = 0;  ///< peak on the device
  uint64_t budget_bytes = 0;  ///< what the device has for us
  int slabs = 1;              ///< pieces the finest images are cut into so that they fit
  bool backward = false;      ///< there is room for the way back that was asked for
  bool sliding = false;  ///< there is room for the step for sliding borders, if it was asked for
};

struct EstimatorOptions {
  MotionOptions motion;
  bool cyclic = false;    ///< after finish(), also last frame -> first
  bool backward = false;  ///< also a quick field from moving to fixed, for examined(), if it fits
  std::optional<Mask>
      mask;  ///< on the frames' grid, of every fixed frame; outside counts for nothing
  /// Frames that may wait; more and the oldest waiting one is dropped, so that the newest win: a
  /// live source must not fall behind. 0: never drop, push() blocks instead until there is room
  /// (two frames wait at most).
  size_t backlog = 0;
};

/// Estimates fields while frames arrive. Reading (the caller), conversion (push), device work and
/// delivery (a worker) overlap. Frames come in rising order of index; a pair is always two frames
/// that follow each other among those kept.
///
///   auto estimator = SequenceEstimator::open(context, grid, options, on_motion, on_progress);
///   for (...) estimator->push(k, frame);
///   Status done = estimator->finish();
///
/// push, finish and cancel may be called from any thread; the callbacks come from the worker, one
/// at a time, and must not call finish(). What they throw ends the work: finish() returns it.
class SequenceEstimator {
 public:
  using OnMotion = std::function<void(PairMotion)>;
  /// The pair in work (fixed, moving) and its share done, 0 to 1.
  using OnProgress = std::function<void(size_t fixed_frame, size_t moving_frame, double share)>;

  /// Plans for frames on `grid`; fails with kOutOfMemory if even slabs do not fit, kBadInput if the
  /// options do not.
  static Result<std::unique_ptr<SequenceEstimator>> open(std::shared_ptr<vulkan::Context> context,
                                                         const Grid& grid, EstimatorOptions options,
                                                         OnMotion on_motion,
                                                         OnProgress on_progress = {});
  virtual ~SequenceEstimator() = default;  ///< cancels what is still running

  virtual const MotionPlan& plan() const = 0;
  virtual MemoryEstimate memory() const = 0;

  /// Takes a frame. kBadInput: another grid, or an index not above the last one's. kCancelled:
  /// after cancel() or finish(). kDeviceFailed: the worker has failed already.
  virtual Status push(size_t frame_index, const Volume& frame) = 0;

  /// No more frames: waits until every field has been delivered and returns what went wrong, if
  /// anything.
  virtual Status finish() = 0;

  /// Stops as soon as the device has finished its current batch; nothing more is delivered after it
  /// returns from the running callback. finish() then returns kCancelled.
  virtual void cancel() = 0;

  /// Frames dropped so far because the newest won.
  virtual size_t dropped() const = 0;
};

/// One pair, waited for. The moving frame is resampled onto the fixed frame's grid if they differ.
Result<PairMotion> estimate_motion(const std::shared_ptr<vulkan::Context>& context,
                                   const Volume& fixed, const Volume& moving,
                                   const EstimatorOptions& options, std::stop_token stop = {},
                                   const std::function<void(double)>& progress = {});

}  // namespace palpate
