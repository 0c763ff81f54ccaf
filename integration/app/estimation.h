#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>

#include "compute/motion/estimator.h"
#include "compute/vulkan/context.h"
#include "integration/app/progress.h"

namespace palpate::app {

/// Fields to estimate, with the source of the frames.
struct EstimationJob {
  Grid grid;               ///< of the fields' frames; a frame on another grid is resampled onto it
  size_t frame_count = 0;  ///< two or more
  /// Called in rising order, once per frame, and in any order for what is read again.
  std::function<Result<Volume>(size_t)> read_frame;
  EstimatorOptions options;
  /// Frames stay in memory until their pairs are judged; otherwise they are read again for it.
  bool keeps_frames = true;

  size_t pair_count() const { return frame_count - 1 + (options.cyclic ? 1 : 0); }
};

/// One estimated pair, with what is needed to judge and draw it.
struct EstimatedPair {
  PairMotion motion;
  std::shared_ptr<const Volume> fixed;  ///< as read, before any resampling
  std::shared_ptr<const Volume> moving;
};

/// Called once per pair, in order, on one thread; may take long.
using OnPair = std::function<Status(EstimatedPair)>;

/// Reads, estimates and delivers in parallel. Prints the memory that it takes before it starts, and
/// its progress. Returns when all threads have ended. Errors: from read_frame, the estimator or
/// on_pair; kCancelled after a stop request.
Status estimate(const std::shared_ptr<vulkan::Context>& context, const EstimationJob& job,
                const OnPair& on_pair, Console& console, std::stop_token stop);

/// What estimations return after a stop request: kCancelled, with a sentence for people.
Error stopped();

}  // namespace palpate::app
