#pragma once

#include <filesystem>
#include <vector>

#include "compute/volume/result.h"
#include "compute/volume/sequence.h"
#include "tests/lab/studies/motion_case.h"

namespace palpate::bench {

/// The real chest CT with known motion (shared data, lung/).
struct CtData {
  studies::MotionCase breath;                          ///< the whole breath at once
  std::vector<studies::MotionCase> steps;              ///< frames 1 to 2 and 3 to 4 of the sequence
  Sequence breathing;                                  ///< 8 frames, cyclic
  std::vector<std::vector<glm::dvec3>> points_lps_mm;  ///< [frame][point]: material points on edges
};

/// Reads lung/ of a data folder. Errors: a file that is missing or broken.
Result<CtData> read_ct(const std::filesystem::path& data);

/// The pair with another contrast in the moving frame: air (-1000 HU) is unchanged, and values
/// above it are multiplied by `gain` and by a smooth bias from 0.8 (front) to 1.2 (back).
studies::MotionCase with_gain(const studies::MotionCase& pair, double gain);

}  // namespace palpate::bench
