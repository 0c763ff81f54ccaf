#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compute/motion/estimator.h"
#include "compute/motion/verdict.h"
#include "compute/volume/sequence_motion.h"
#include "integration/toolkit/handles.h"

namespace palpate::toolkit {

/// The content of a PalMotion. Immutable.
struct MotionContent {
  Grid grid;  ///< of the frames; of an old file, the one on which the motion was solved
  bool is_from_file = false;  ///< the host's frames may lie on a grid of their own
  size_t frames = 0;
  std::vector<Field> steps;  ///< on the grids on which they were solved; empty with `whole`
  std::optional<SequenceMotion> whole;
  std::vector<Confidence> confidence;  ///< of steps, or from the reference to each frame
  TimeBasis times;                     ///< of the frames, from the first on
  double begin_s = 0.0;                ///< time of the first frame on the host's clock
  // Measurements.
  std::optional<Verdict> verdict;
  std::string reasons;
  double seconds = 0.0;
  Spread motion_mm;
  std::optional<Folds> folds;  ///< the worst
  std::optional<Match> match;  ///< the worst
  std::optional<Distances> drift;
  std::optional<double> within_95_mm;  ///< the worst

  size_t step_count() const {
    return whole ? frames - (whole->basis.cycle_s > 0.0 ? 0 : 1) : steps.size();
  }
};

class EstimatorContent;

inline Handle<MotionContent>* of(PalMotion* handle) noexcept {
  return reinterpret_cast<Handle<MotionContent>*>(handle);
}
inline Handle<EstimatorContent>* of(PalEstimator* handle) noexcept {
  return reinterpret_cast<Handle<EstimatorContent>*>(handle);
}
inline Handle<EstimatorContent>* of(const PalEstimator* handle) noexcept {
  return of(const_cast<PalEstimator*>(handle));
}
inline Handle<MotionContent>* of(const PalMotion* handle) noexcept {
  return of(const_cast<PalMotion*>(handle));
}

/// One motion for all frames; frame-to-frame fields are composed to one. Errors: kBadInput if there
/// are none.
Result<SequenceMotion> whole_of(const MotionContent& motion);

}  // namespace palpate::toolkit
