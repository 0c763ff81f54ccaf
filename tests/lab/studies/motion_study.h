#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "integration/app/choice/motion_front.h"
#include "tests/lab/report/pareto.h"
#include "tests/lab/report/table.h"
#include "tests/lab/studies/motion_case.h"
#include "tests/lab/studies/motion_contender.h"
#include "tests/lab/studies/reliability.h"
#include "tests/lab/studies/study.h"

namespace palpate::studies {

/// Where two measured times are held to differ: machines are noisy.
inline constexpr double kTimeMargin = 0.10;
/// Where two errors are.
inline constexpr double kErrorMargin = 0.02;

/// What was measured of one method on one pair.
struct MotionMeasure {
  std::string name, family;
  bool ours = false, preset = false;
  bool careful = false;       ///< may be chosen for a person, see app::MotionSetting
  double seconds = 0.0;       ///< median
  double spread_share = 0.0;  ///< (longest - shortest) / median of the timed runs; 0 for one run
  double error_mm = 0.0, error_p95_mm = 0.0;
  double own_voxels = 0.0, own_voxels_p95 = 0.0;  ///< each axis in its own; 0 without a true field
  double voxel_mm = 1.0;                          ///< finest edge of the pair
  size_t folded = 0;                              ///< voxels of the image that fold
  double there_and_back_mm = std::numeric_limits<double>::quiet_NaN();  ///< mean; NaN: not measured
  double work_bytes = std::numeric_limits<double>::quiet_NaN();
  double device_bytes = std::numeric_limits<double>::quiet_NaN();  ///< peak; NaN: not known
  std::optional<Reliability> reliability = {};  ///< of palpate's presets, where a field is known

  double error_voxels() const { return error_mm / voxel_mm; }
  report::Costs costs() const { return {seconds, error_mm}; }
};

/// A pair, all that was measured on it, and what could not be.
struct MotionMeasures {
  std::string id, name;
  size_t voxels = 0;
  double voxel_mm = 1.0;
  double still_error_mm = 0.0;  ///< of a field of zeros: what every method must beat
  std::vector<MotionMeasure> rows;
  std::vector<std::string> missing;  ///< sentences about methods that could not be run
};

/// Runs every method on the pair, in this order: palpate's once to be warm, then timed at most
/// run.runs times (no more than it takes until two times agree within kTimeMargin), then from
/// moving to fixed; peers once, and back where that does not take long. A peer gets a quarter of
/// the time that is left until run.end_s, methods for which none is left are left out. Each method
/// goes when it is done: it holds device memory. Throws Mismatch or vulkan::Failure of palpate's
/// own; what a peer can not do, and what was left out, becomes a sentence in `missing`. Ends early,
/// with the rows so far, where run.stop asks for it.
MotionMeasures measure_motion(const StudyRun& run, const MotionCase& known,
                              std::vector<std::unique_ptr<PairMethod>> methods);

/// The front of palpate's own settings among measured rows (peers are not on it), leaving out what
/// folds and what is not careful.
app::MotionFront front_of(const MotionMeasures& measures, const std::string& device,
                          const std::string& version);

/// Settings of palpate, as methods: every one, or those that differ most.
std::vector<std::unique_ptr<PairMethod>> palpate_methods(const StudyRun& run, bool few);

/// All rows, for people and as CSV.
report::Table motion_table(const MotionMeasures& measures);

}  // namespace palpate::studies
