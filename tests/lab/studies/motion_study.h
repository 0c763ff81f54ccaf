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

/// Two measured times differ if they differ by more than this: machines are noisy.
inline constexpr double kTimeMargin = 0.10;
/// The same for two errors.
inline constexpr double kErrorMargin = 0.02;

/// The measurements of one method on one pair.
struct MotionMeasure {
  std::string name, family;
  bool ours = false, preset = false;
  /// May be chosen for a user, see app::MotionSetting.
  bool careful = false;
  double seconds = 0.0;       ///< median
  double spread_share = 0.0;  ///< (longest - shortest) / median of the timed runs; 0 for one run
  double error_mm = 0.0, error_p95_mm = 0.0;
  /// Each axis in its own voxels; 0 without a true field.
  double own_voxels = 0.0, own_voxels_p95 = 0.0;
  double voxel_mm = 1.0;  ///< finest edge of the pair
  size_t folded = 0;      ///< voxels of the image that fold
  double there_and_back_mm = std::numeric_limits<double>::quiet_NaN();  ///< mean; NaN: not measured
  double work_bytes = std::numeric_limits<double>::quiet_NaN();
  double device_bytes = std::numeric_limits<double>::quiet_NaN();  ///< peak; NaN: not known
  std::optional<Reliability> reliability = {};  ///< of palpate's presets, where a field is known

  double error_voxels() const { return error_mm / voxel_mm; }
  report::Costs costs() const { return {seconds, error_mm}; }
};

/// A pair, all its measurements, and the methods that could not be run.
struct MotionMeasures {
  std::string id, name;
  size_t voxels = 0;
  double voxel_mm = 1.0;
  /// Of a field of zeros: every method must be better.
  double still_error_mm = 0.0;
  std::vector<MotionMeasure> rows;
  std::vector<std::string> missing;  ///< sentences about methods that could not be run
};

/// Runs every method on the pair, in this order. palpate's: once to warm up, then timed at most
/// run.runs times (until two times agree within kTimeMargin), then from moving to fixed. Peers:
/// once, and backward if that does not take long. A peer gets a quarter of the time that is left
/// until run.end_s; methods without any time left are left out. Each method is destroyed when it is
/// done, because it uses device memory. Throws Mismatch or vulkan::Failure of palpate's own
/// methods; failures of peers, and methods that were left out, become sentences in `missing`. Ends
/// early, with the rows so far, after a request by run.stop.
MotionMeasures measure_motion(const StudyRun& run, const MotionCase& known,
                              std::vector<std::unique_ptr<PairMethod>> methods);

/// The front of palpate's own settings among measured rows (peers are not on it), without fields
/// that fold and without settings that are not careful.
app::MotionFront front_of(const MotionMeasures& measures, const std::string& device,
                          const std::string& version);

/// palpate's settings as methods: all, or those that differ most.
std::vector<std::unique_ptr<PairMethod>> palpate_methods(const StudyRun& run, bool few);

/// All rows, for the page and as CSV.
report::Table motion_table(const MotionMeasures& measures);

}  // namespace palpate::studies
