#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compute/motion/options.h"

namespace palpate::app {

/// One way of running palpate's motion estimation, with a name that stays: a measured front refers
/// to it.
struct MotionSetting {
  std::string name;  ///< "balanced", "balanced, twice the iterations"
  std::string
      sweep;  ///< "presets", "levels", "iterations", "smoothing", "intensities", "grids", "bricks"
  MotionOptions options;
  /// Keeps what other data need: local normalisation (contrast changes) and the start for large
  /// motion. Only such settings are ever chosen for a person.
  bool careful = true;

  bool is_preset() const { return sweep == "presets"; }
};

/// The presets, classic, and what is varied around them. quick: about a third of it, the ones that
/// differ most.
std::vector<MotionSetting> motion_settings(bool quick);

/// The setting of a name; nothing for an unknown one.
std::optional<MotionSetting> motion_setting(const std::string& name);

}  // namespace palpate::app
