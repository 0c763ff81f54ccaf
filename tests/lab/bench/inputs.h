#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "tests/lab/studies/motion_case.h"

namespace palpate::bench {

/// The user's own pair, as the command line names it.
struct OwnPair {
  std::filesystem::path fixed, moving;
  std::filesystem::path truth;                   ///< a field; or
  std::vector<std::filesystem::path> landmarks;  ///< two tables, fixed and moving
  std::filesystem::path mask;                    ///< where the error counts; with a truth
};

/// Reads it; a moving frame on another grid is resampled. Errors: kBadInput with a message.
Result<studies::MotionCase> read_own_pair(const OwnPair& pair);

/// The real chest CT with known motion in `folder` (pair_fixed.mha, ...); nothing if there is none.
Result<std::optional<studies::MotionCase>> read_known_ct(const std::filesystem::path& folder);

}  // namespace palpate::bench
