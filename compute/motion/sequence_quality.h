#pragma once

#include <functional>
#include <span>
#include <vector>

#include "compute/motion/quality_folds.h"
#include "compute/motion/verdict.h"
#include "compute/volume/sequence_motion.h"
#include "compute/volume/volume.h"

namespace palpate {

/// u at every frame of a motion, on its own grid.
std::vector<Field> fields_at_frames(const SequenceMotion& motion);

/// The motion that fields of consecutive frames tell, one after the other, told from frame 0. As
/// many fields as frames: a cycle, which then closes only as well as they do.
SequenceMotion chained(std::span<const Field> consecutive, std::span<const double> times_s);

/// rms over all samples (of the mask, on the fields' grid, if not null) of u_{k+1} - 2 u_k +
/// u_{k-1}, one per frame, mm; 0 at the ends of what is not cyclic.
std::vector<double> accelerations_mm(std::span<const Field> at_frame, bool cyclic,
                                     const Mask* mask = nullptr);

/// Folds in the middle of the step after each frame, one per frame; empty after the last of what is
/// not cyclic.
std::vector<Folds> folds_between(const SequenceMotion& motion);

/// Measures one motion against its frames: per frame as a pair with the reference, folds between
/// frames, acceleration; not the drift. `frames` may be empty: then nothing is compared.
/// `confidence`: empty, or one per frame. `tell` (may be empty) hears of each frame when it is
/// measured.
Result<SequenceEvidence> examined(const SequenceMotion& motion, const std::vector<Volume>& frames,
                                  const std::vector<Confidence>& confidence, const Mask* mask,
                                  const std::function<void(const SequenceEvidence&, size_t)>& tell);

}  // namespace palpate
