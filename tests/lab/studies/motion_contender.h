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

/// What one method gave for one pair.
struct PairResult {
  Field field;  ///< mm, LPS, on any grid
  double seconds = 0.0;
  double work_bytes = std::numeric_limits<double>::quiet_NaN();  ///< see motion_work.h; peers: none
  double device_bytes = std::numeric_limits<double>::quiet_NaN();  ///< peak; peers: not known
  std::optional<Confidence> confidence = {};  ///< nothing where a method has no word for it
};

/// A method that finds the motion between two frames on one grid. One thread at a time.
class PairMethod {
 public:
  virtual ~PairMethod() = default;
  /// Errors: kCancelled where patience runs out (its seconds end other programs only: palpate's own
  /// methods are quick), and what goes wrong.
  virtual Result<PairResult> run(const Volume& fixed, const Volume& moving,
                                 const report::Patience& patience = {}) = 0;
  virtual std::string name() const = 0;    ///< "balanced", "Diffeomorphic Demons"
  virtual std::string family() const = 0;  ///< "palpate presets", "ITK": a series of the plot
  virtual bool is_ours() const { return false; }
  virtual bool is_preset() const { return false; }
  virtual bool is_careful() const { return false; }  ///< see MotionSetting::careful
  /// About how long all its runs take beside those of "balanced": for a progress bar.
  virtual double weight() const { return 1.0; }
  /// Peers that take long are run once; ours once to be warm and then several times.
  virtual bool runs_once() const { return true; }
};

/// palpate with a setting. Seconds: from frames in host memory to the field there, kernels
/// compiled and memory reserved. The first run verifies that it is what estimate_motion() gives;
/// throws Mismatch if not.
std::unique_ptr<PairMethod> palpate_method(std::shared_ptr<vulkan::Context> context,
                                           app::MotionSetting setting);

}  // namespace palpate::studies
