#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "compute/motion/estimate_sequence.h"
#include "compute/motion/verdict.h"
#include "integration/app/delivery.h"
#include "integration/app/outputs.h"
#include "integration/app/progress.h"
#include "integration/files/frames.h"

namespace palpate::app {

/// All frames of a sequence in memory, for work that asks for each more than once. kOutOfMemory if
/// they do not fit, with what to do instead.
Result<std::vector<Volume>> all_frames(Frames& frames, std::stop_token stop);

struct SequenceOutputOptions {
  std::string format = "mha";                                   ///< ending of the fields
  std::function<PairNames(size_t fixed, size_t moving)> names;  ///< of consecutive frames
  bool coarse = false;         ///< fields on the solved grid instead of the image's
  const Mask* mask = nullptr;  ///< on the frames' grid
};

/// Name of the field from the reference to a frame.
std::string reference_field_name(const std::string& format, size_t frame, size_t count);

/// Measures one motion against its frames: per frame as a pair with the reference, folds between
/// frames, acceleration; not the drift. `frames` may be empty: then nothing is compared.
/// `confidence`: empty, or one per frame. `tell` (may be empty) hears of each frame when it is
/// measured.
Result<SequenceEvidence> examined(const SequenceMotion& motion, const std::vector<Volume>& frames,
                                  const std::vector<Confidence>& confidence, const Mask* mask,
                                  const std::function<void(const SequenceEvidence&, size_t)>& tell);

/// Where points are after a cycle of the fields from frame to frame that follow from a cyclic
/// motion, at the samples of `image` (inside the mask on it, if not null).
Distances drift_of(const SequenceMotion& motion, const Grid& image, const Mask* mask);

/// What was written, for the summary, and the drift of the fields from frame to frame in a cycle.
struct Written {
  nlohmann::json files;
  std::optional<Distances> drift;
};

/// Writes one motion: the one file, the fields from the reference to all frames, and those from
/// each frame to the next as they follow from it (confidences: of `pairs`, where they are asked
/// for).
Result<Written> write_sequence(const SequenceMotion& motion, const std::vector<Volume>& frames,
                               const std::vector<Confidence>& step_confidence,
                               const SequenceOutputOptions& options, Outputs& outputs);

}  // namespace palpate::app
