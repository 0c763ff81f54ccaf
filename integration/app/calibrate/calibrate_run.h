#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>

#include "integration/app/force_device.h"

namespace palpate::app {

/// The options of calibrating.
struct CalibrateCommand {
  std::filesystem::path output;
  std::string by = "points";   ///< points or movement
  std::string hand = "right";  ///< that holds the controller
  ForceDeviceChoice device;
  int points = 12;
  double seconds = 0.0;  ///< of movement; 0: 30, for a pivot 15
  std::string tip;       ///< of the controller: X,Y,Z in its grip, mm; pivot; empty: its origin
  double wait_s = 0.0;   ///< give up after so long without a headset; 0: never
  bool quiet = false;
};

/// The place that --tip gives, m; nothing if it gives none (pivot, or an invalid text).
std::optional<glm::dvec3> tip_of(const std::string& text);

/// Guides a person from no headset to a stored and checked calibration; returns the exit code. From
/// the main thread, before others are started.
int run_calibrate(const CalibrateCommand& command);

}  // namespace palpate::app
