#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "compute/motion/estimator.h"
#include "compute/motion/verdict.h"
#include "compute/volume/sequence_motion.h"

namespace palpate::app {

/// The measurements as JSON, with units in the names; numbers that are not finite become null.
nlohmann::json json_of(const Spread& spread);
nlohmann::json json_of(const Distances& distances);
nlohmann::json json_of(const Folds& folds);
nlohmann::json json_of(const Match& match);
nlohmann::json json_of(const Evidence& evidence);
nlohmann::json json_of(const Verdict& verdict);
nlohmann::json json_of(const Grid& grid);
nlohmann::json json_of(const SolveReport& report);

/// The distances of points from their start after one cycle, for two sets of points.
struct CycleDrift {
  Distances everywhere;                ///< samples of the first field, inside the mask
  std::optional<Distances> structure;  ///< voxels where the first pair shows structure (examined())

  /// The set that the verdict is based on.
  const Distances& judged() const { return structure ? *structure : everywhere; }
};
nlohmann::json json_of(const CycleDrift& drift);

/// One object per frame, and the drift; without the reference's own evidence.
nlohmann::json json_of(const SequenceEvidence& evidence);

/// ", expected error below 0.31 mm at 95 % of the structure"; nothing if it is not known.
std::string within_text(const Evidence& evidence);

/// "Frame 3   moves 2.10 mm on average and 9.32 mm at most, no folds, none on the way to the next,
/// acceleration 0.31 mm/frame^2, local correlation 0.712 -> 0.951, 0.042 voxel of motion left: ok".
std::string frame_text(const SequenceEvidence& evidence, size_t frame);

/// "6 harmonics of a cycle of 0.8 s", "smooth curves between the frames of a cycle of 4 s".
std::string time_text(const TimeBasis& basis);

/// The drift as a line for the user.
std::string cycle_text(const CycleDrift& drift);

/// "no folds" or "12 of 2000 voxels fold".
std::string folds_text(const Folds& folds);

/// The verdict as lines for the user: the word, then its reasons; if ok, the checks passed.
std::string verdict_text(const Verdict& verdict);

}  // namespace palpate::app
