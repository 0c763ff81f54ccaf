#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "compute/volume/field.h"
#include "compute/volume/result.h"
#include "compute/volume/volume.h"
#include "integration/app/choice/motion_settings.h"
#include "tests/lab/report/child.h"

namespace palpate::vulkan {
class Context;
}

namespace palpate::studies {

/// The result of one method for one pair.
struct PairResult {
  Field field;  ///< mm, LPS, on any grid
  double seconds = 0.0;
  /// See motion_work.h; peers: none.
  double work_bytes = std::numeric_limits<double>::quiet_NaN();
  /// Peak; peers: unknown.
  double device_bytes = std::numeric_limits<double>::quiet_NaN();
  /// Nothing if the method gives no confidence.
  std::optional<Confidence> confidence = {};
};

/// A method that finds the motion between two frames on one grid. One thread at a time.
class PairMethod {
 public:
  virtual ~PairMethod() = default;
  /// Errors: kCancelled if patience ends (its seconds end only other programs: palpate's own
  /// methods are fast), and other failures.
  virtual Result<PairResult> run(const Volume& fixed, const Volume& moving,
                                 const report::Patience& patience = {}) = 0;
  virtual std::string name() const = 0;    ///< "balanced", "Diffeomorphic Demons"
  virtual std::string family() const = 0;  ///< "palpate presets", "ITK": a series of the plot
  virtual bool is_ours() const { return false; }
  virtual bool is_preset() const { return false; }
  virtual bool is_careful() const { return false; }  ///< see MotionSetting::careful
  /// The approximate time of all its runs relative to those of "balanced": for a progress bar.
  virtual double weight() const { return 1.0; }
  /// Slow peers are run once; palpate's methods once to warm up and then several times.
  virtual bool runs_once() const { return true; }
};

/// palpate with a setting. Seconds: from frames in host memory to the field there, with kernels
/// compiled and memory reserved. The first run verifies that the result is that of
/// estimate_motion(); throws Mismatch if not.
std::unique_ptr<PairMethod> palpate_method(std::shared_ptr<vulkan::Context> context,
                                           app::MotionSetting setting);

}  // namespace palpate::studies
