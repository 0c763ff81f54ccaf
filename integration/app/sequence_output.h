#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "compute/motion/estimate_sequence.h"
#include "compute/motion/sequence_quality.h"
#include "compute/motion/verdict.h"
#include "integration/app/delivery.h"
#include "integration/app/outputs.h"
#include "integration/app/progress.h"
#include "integration/files/frames.h"

namespace palpate::app {

/// Reads all frames of a sequence into memory, for work that uses each more than once. Errors:
/// kOutOfMemory if they do not fit, with what to do instead.
Result<std::vector<Volume>> all_frames(Frames& frames, std::stop_token stop);

struct SequenceOutputOptions {
  std::string format = "mha";                                   ///< ending of the fields
  std::function<PairNames(size_t fixed, size_t moving)> names;  ///< of consecutive frames
  bool coarse = false;         ///< fields on the solved grid instead of the image's
  const Mask* mask = nullptr;  ///< on the frames' grid
};

/// File name of the field from the reference to a frame.
std::string reference_field_name(const std::string& format, size_t frame, size_t count);

/// The files that were written, for the summary, and the drift of the frame-to-frame fields of a
/// cycle.
struct Written {
  nlohmann::json files;
  std::optional<Distances> drift;
};

/// Writes one motion: its file, the fields from the reference to all frames, and those from each
/// frame to the next that follow from it (with the confidences of `pairs`, if asked for).
Result<Written> write_sequence(const SequenceMotion& motion, const std::vector<Volume>& frames,
                               const std::vector<Confidence>& step_confidence,
                               const SequenceOutputOptions& options, Outputs& outputs);

}  // namespace palpate::app
