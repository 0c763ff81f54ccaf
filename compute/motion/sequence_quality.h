#pragma once

#include <functional>
#include <span>
#include <vector>

#include "compute/motion/quality_folds.h"
#include "compute/motion/verdict.h"
#include "compute/volume/sequence_motion.h"
#include "compute/volume/volume.h"

namespace palpate {

/// The field u at every frame of a motion, on the motion's grid.
std::vector<Field> fields_at_frames(const SequenceMotion& motion);

/// The motion that follows from fields of consecutive frames one after the other, with frame 0 as
/// the reference. With as many fields as frames it is cyclic; it then closes only as well as the
/// fields do.
SequenceMotion chained(std::span<const Field> consecutive, std::span<const double> times_s);

/// rms of u_{k+1} - 2 u_k + u_{k-1} over all samples, one value per frame, mm; 0 at the first and
/// last frame if not cyclic. mask: null, or on the fields' grid; only its samples count.
std::vector<double> accelerations_mm(std::span<const Field> at_frame, bool cyclic,
                                     const Mask* mask = nullptr);

/// What happens between a frame and the next, at a quarter, the middle and three quarters of the
/// way: the time with most folds, and how far the path leaves the straight line.
struct BetweenFrames {
  Folds folds;
  Excursion excursion;
};

/// One value per frame; empty after the last frame if not cyclic.
std::vector<BetweenFrames> between_frames(const SequenceMotion& motion);

/// Measures one motion against its frames: per frame as a pair with the reference, folds between
/// frames, acceleration, the order of the frames; not the drift. `frames` may be empty: then
/// nothing is compared. `confidence`: empty, or one per frame. `tell` (may be empty) is called
/// after each frame.
Result<SequenceEvidence> examined(const SequenceMotion& motion, const std::vector<Volume>& frames,
                                  const std::vector<Confidence>& confidence, const Mask* mask,
                                  const std::function<void(const SequenceEvidence&, size_t)>& tell);

}  // namespace palpate
