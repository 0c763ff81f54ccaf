#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compute/motion/options.h"

namespace palpate::app {

/// A setting of palpate's motion estimation, with a fixed name by which a measured front refers to
/// it.
struct MotionSetting {
  std::string name;  ///< "balanced", "balanced, twice the iterations"
  /// "presets", "levels", "iterations", "smoothing", "intensities", "grids", "bricks"
  std::string sweep;
  MotionOptions options;
  /// Whether it keeps what other data need: local normalisation (against contrast changes) and the
  /// start for large motion. Only such settings are chosen automatically.
  bool careful = true;

  bool is_preset() const { return sweep == "presets"; }
};

/// The presets, classic, and variations of them. quick: about a third of these, the most different
/// ones.
std::vector<MotionSetting> motion_settings(bool quick);

/// The setting of a name; nothing for an unknown one.
std::optional<MotionSetting> motion_setting(const std::string& name);

}  // namespace palpate::app
