#pragma once

#include "compute/volume/result.h"
#include "tests/lab/report/page.h"
#include "tests/lab/studies/feel_runs.h"

namespace palpate::studies {

/// All that the feel study measured.
struct FeelMeasures {
  std::vector<FeelMeasure> settings;
  std::vector<InversionMeasure> picard;
  InversionMeasure newton;
  struct Load {
    int volumes = 1, modes = 1;
    double median_us = 0.0;
  };
  /// Hearts that beat and rotate.
  std::vector<Load> loads;
};

/// Runs the hands. Throws Mismatch. Ends early after a request by run.stop.
FeelMeasures measure_feel(const StudyRun& run);

/// Sentences about the measurements, computed from them alone.
std::vector<std::string> feel_sentences(const FeelMeasures& measures);

/// Feel's part of the report. Errors: matplotlib missing.
Result<report::Section> feel_section(const FeelMeasures& measures);

}  // namespace palpate::studies
