#pragma once

#include <filesystem>
#include <vector>

#include "compute/volume/sequence.h"
#include "tests/lab/bench/peers/metaimage_case.h"

namespace palpate::bench {

/// The real chest CT in known motion (shared data, lung/).
struct LungData {
  peers::KnownPair pair;                               ///< the whole breath at once
  peers::KnownPair step_1;                             ///< frames 1 to 2 of the sequence
  peers::KnownPair step_3;                             ///< frames 3 to 4
  Sequence breathing;                                  ///< 8 frames, cyclic
  std::vector<std::vector<glm::dvec3>> points_lps_mm;  ///< [frame][point]: material points on edges
};

/// Reads lung/ of a data folder. Errors: a file that is missing or broken.
Result<LungData> read_lung(const std::filesystem::path& data);

/// The pair with the moving frame's contrast changed: air (-1000 HU) stays, and what is above it is
/// multiplied by `gain` and by a slow bias from 0.8 (front) to 1.2 (back).
peers::KnownPair with_gain(const peers::KnownPair& pair, double gain);

}  // namespace palpate::bench
