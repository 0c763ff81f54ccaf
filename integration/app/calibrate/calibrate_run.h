#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "integration/app/force_device.h"

namespace palpate::app {

/// What the command line says of calibrating.
struct CalibrateCommand {
  std::filesystem::path output;
  std::string by = "points";   ///< points or movement
  std::string hand = "right";  ///< that holds the controller
  ForceDeviceChoice device;
  int points = 12;
  double seconds = 30.0;       ///< of movement
  std::vector<double> tip_mm;  ///< of the controller, in its grip; empty: its origin
  double wait_s = 0.0;         ///< give up after so long without a headset; 0: never
  bool quiet = false;
};

/// Guides a person from no headset to a stored and checked calibration; returns the exit code. From
/// the main thread, before others are started.
int run_calibrate(const CalibrateCommand& command);

}  // namespace palpate::app
