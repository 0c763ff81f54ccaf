#pragma once

#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "tests/lab/report/page.h"
#include "tests/lab/studies/hearts.h"
#include "tests/lab/studies/study.h"

namespace palpate::studies {

/// What content costs.
struct SceneMeasures {
  struct Felt {
    int volumes = 1;
    Moves moves = Moves::kNothing;
    double median_us = 0.0;  ///< of one haptic frame
  };
  std::vector<Felt> felt;
  struct Region {
    double share = 1.0;      ///< of the volume that counts
    double solve_s = 0.0;    ///< iterations on the device
    double prepare_s = 0.0;  ///< upload, pyramid, normalisation: of the whole volume
    double bricks = 0.0;     ///< brick iterations
  };
  std::vector<Region> regions;
  double still_s = 0.0;              ///< motion of a pair that does not move, solved
  double moving_s = 0.0;             ///< of the one that does
  std::vector<std::string> missing;  ///< sentences about what was left out
};

/// Measures; regions for which no time is left until run.end_s are left out, but for the whole and
/// the smallest. Throws Mismatch or vulkan::Failure. Ends early where run.stop asks for it.
SceneMeasures measure_scene(const StudyRun& run);

/// Sentences about the measurements, worked out from them alone.
std::vector<std::string> scene_sentences(const SceneMeasures& measures);

/// Scene's part of the report. Errors: gnuplot missing.
Result<report::Section> scene_section(const SceneMeasures& measures);

}  // namespace palpate::studies
