#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "compute/motion/estimator.h"
#include "compute/motion/verdict.h"
#include "compute/volume/sequence_motion.h"

namespace palpate::app {

/// The measures as JSON, with units in the names; numbers that are not finite become null.
nlohmann::json json_of(const Spread& spread);
nlohmann::json json_of(const Distances& distances);
nlohmann::json json_of(const Folds& folds);
nlohmann::json json_of(const Match& match);
nlohmann::json json_of(const Evidence& evidence);
nlohmann::json json_of(const Verdict& verdict);
nlohmann::json json_of(const Grid& grid);
nlohmann::json json_of(const SolveReport& report);

/// Where points are after one cycle, from two sets of them.
struct CycleDrift {
  Distances everywhere;                ///< samples of the first field, inside the mask
  std::optional<Distances> structure;  ///< voxels where the first pair shows structure (examined())

  /// The subject of the verdict.
  const Distances& judged() const { return structure ? *structure : everywhere; }
};
nlohmann::json json_of(const CycleDrift& drift);

/// One object per frame and the drift; the reference's own evidence is left out.
nlohmann::json json_of(const SequenceEvidence& evidence);

/// "Frame 3   moves 2.10 mm on average and 9.32 mm at most, no folds, none on the way to the next,
/// acceleration 0.31 mm/frame^2, local correlation 0.712 -> 0.951, 0.042 voxel of motion left: ok".
std::string frame_text(const SequenceEvidence& evidence, size_t frame);

/// "6 harmonics of a cycle of 0.8 s", "smooth curves between the frames of a cycle of 4 s".
std::string time_text(const TimeBasis& basis);

/// The drift as a line for a person.
std::string cycle_text(const CycleDrift& drift);

/// "no folds" or "12 of 2000 voxels fold".
std::string folds_text(const Folds& folds);

/// The verdict in lines for a person: the word, then its reasons; if ok, what was found good.
std::string verdict_text(const Verdict& verdict);

}  // namespace palpate::app
