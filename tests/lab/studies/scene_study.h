#pragma once

#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "tests/lab/report/page.h"
#include "tests/lab/studies/hearts.h"
#include "tests/lab/studies/study.h"

namespace palpate::studies {

/// The cost of a scene's content.
struct SceneMeasures {
  struct Felt {
    int volumes = 1;
    Moves moves = Moves::kNothing;
    double median_us = 0.0;  ///< of one haptic frame
  };
  std::vector<Felt> felt;
  struct Region {
    /// Of the volume that is inside the mask.
    double share = 1.0;
    double solve_s = 0.0;  ///< iterations on the device
    /// Upload, pyramid, normalisation, of the whole volume.
    double prepare_s = 0.0;
    double bricks = 0.0;  ///< brick iterations
  };
  std::vector<Region> regions;
  /// Motion of a pair without motion, solver time.
  double still_s = 0.0;
  /// Of the pair with motion.
  double moving_s = 0.0;
  std::vector<std::string> missing;  ///< sentences about what was left out
};

/// Measures. Regions for which no time is left until run.end_s are left out, except the whole and
/// the smallest. Throws Mismatch or vulkan::Failure. Ends early after a request by run.stop.
SceneMeasures measure_scene(const StudyRun& run);

/// Sentences about the measurements, computed from them alone.
std::vector<std::string> scene_sentences(const SceneMeasures& measures);

/// Scene's part of the report. Errors: matplotlib missing.
Result<report::Section> scene_section(const SceneMeasures& measures);

}  // namespace palpate::studies
