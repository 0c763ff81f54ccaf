#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "tests/lab/report/page.h"
#include "tests/lab/studies/study.h"

namespace palpate::studies {

/// One way of drawing, and its measurements.
struct ViewMeasure {
  /// "sparse": a thin shell; "dense": partly transparent everywhere.
  std::string look;
  std::string family;  ///< a series of the plot
  double samples_per_voxel = 1.0;
  int pixels = 512;         ///< along each side of an eye's picture
  double time_ms = 0.0;     ///< a stereo picture, median
  double quality_db = 0.0;  ///< PSNR against the same picture with 8 samples per voxel
};

/// Draws the heart in stereo in many ways, until run.end_s: a sentence in `missing` for each that
/// was left out. Ends early after a request by run.stop. Throws vulkan::Failure or Mismatch.
std::vector<ViewMeasure> measure_view(const StudyRun& run, std::vector<std::string>& missing);

/// A row for each.
report::Table view_table(const std::vector<ViewMeasure>& all);

/// Sentences about the measurements, computed from them alone.
std::vector<std::string> view_sentences(const std::vector<ViewMeasure>& measures);

/// View's part of the report; missing: sentences about what was left out. Errors: matplotlib
/// missing.
Result<report::Section> view_section(const std::vector<ViewMeasure>& measures,
                                     const std::vector<std::string>& missing);

}  // namespace palpate::studies
