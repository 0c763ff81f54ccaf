#pragma once

#include <string>
#include <vector>

#include "tests/lab/stability/shell.h"
#include "tests/lab/studies/hearts.h"
#include "tests/lab/studies/study.h"

/// Time of a haptic frame and accuracy of its force, from runs of simulated hands.
namespace palpate::studies {

/// One way of feeling a sphere whose exact force is known.
struct FeelSetting {
  std::string name, family;
  bool paper = false;  ///< the paper's loop, built from the same parts
  Moves moves = Moves::kNothing;
  BackTracking method = BackTracking::kNewton;
  double data_mm = 1.0, field_mm = 1.0;  ///< spacing of the samples
  stability::Made made = stability::Made::kSampled;
};

struct FeelMeasure {
  FeelSetting setting;
  double median_us = 0.0, p99_us = 0.0;  ///< of one haptic frame
  double rms_n = 0.0, most_n = 0.0;      ///< force error
  /// Of the exact force.
  double exact_rms_n = 0.0;
  int64_t held = 0;  ///< frames in which a point was not found
  double field_megabytes = 0.0;
  double percent() const { return 100.0 * rms_n / exact_rms_n; }
};

/// Moves a hand at up to 100 mm/s over and into the sphere, `strokes` times 4 s, and compares every
/// force with the exact one. With transforms, the sphere rotates about its middle, which changes no
/// force. Throws Mismatch.
FeelMeasure feel(const FeelSetting& setting, int strokes);

/// Microseconds of one frame, median, for a number of beating hearts with a number of modes each.
double hearts_us(int volumes, int modes_of_each, Moves moves, int ticks);

/// The residual of inverting a motion by a number of steps, mean over places in the heart's field.
struct InversionMeasure {
  int steps = 0;
  double residual_um = 0.0;  ///< root mean square
  /// Of one inversion, median of batches.
  double time_us = 0.0;
};
/// The paper's fixed point (27) with a number of steps.
InversionMeasure picard_inversion(int steps, int places);
/// palpate's Newton method; steps is the mean number that it needed, rounded.
InversionMeasure newton_inversion(int places);

}  // namespace palpate::studies
