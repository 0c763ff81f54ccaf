#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "integration/app/choice/motion_settings.h"

namespace palpate::app {

/// A measured setting: its cost per voxel and its error.
struct FrontPoint {
  std::string setting;  ///< a name that motion_setting() knows
  double seconds = 0.0;
  double error_voxels = 0.0;
};

/// The measurements of palpate's settings on a machine, from which `palpate motion --within`
/// chooses. Only the Pareto front: settings that no other one beats in both speed and accuracy.
struct MotionFront {
  std::string device;              ///< name of the Vulkan device
  std::string version;             ///< of palpate
  std::string pair;                ///< what was measured on, for people
  size_t voxels = 0;               ///< of that pair
  std::vector<FrontPoint> points;  ///< in rising order of seconds
};

/// As JSON text, and back. Errors: kBadInput with a sentence that says to run `palpate chart
/// motion` again.
std::string front_text(const MotionFront& front);
Result<MotionFront> parse_front(const std::string& text);

/// A chosen setting, and the sentence with the reason.
struct Choice {
  MotionSetting setting;
  double expected_s = 0.0;
  double expected_error_mm = 0.0;
  std::string why;
};

/// The most accurate setting that is expected to take at most `seconds` for a pair of `voxels`
/// voxels (times are scaled by the number of voxels). Errors: kBadInput, with the time, if even the
/// fastest takes longer.
Result<Choice> choose_within(const MotionFront& front, double seconds, size_t voxels,
                             double voxel_mm);

/// The settings whose error is expected to be at most `error_mm` for voxels of `voxel_mm` (errors
/// are scaled by the voxel's finest edge), fastest first; each next one is slower and expected to
/// be more accurate. Errors: kBadInput if even the most accurate one is not good enough.
Result<std::vector<Choice>> choose_by_error(const MotionFront& front, double error_mm,
                                            size_t voxels, double voxel_mm);

}  // namespace palpate::app
