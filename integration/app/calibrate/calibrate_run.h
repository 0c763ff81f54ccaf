#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>

namespace palpate::app {

/// The options of calibrating.
struct CalibrateCommand {
  std::filesystem::path output;
  std::string by = "points";              ///< points or movement
  std::string hand = "right";             ///< the hand with the controller
  std::string device = "auto";            ///< a kind of force device, or simulated
  std::filesystem::path falcon_firmware;  ///< the user's own file
  int points = 12;
  double seconds = 0.0;  ///< duration of movement; 0: 30 s, for a pivot 15 s
  std::string tip;       ///< of the controller: X,Y,Z in its grip, mm; or pivot; empty: its origin
  double wait_s = 0.0;   ///< give up after this time without a headset; 0: never
  bool quiet = false;
};

/// The place that --tip gives, m; empty for pivot and for an invalid text.
std::optional<glm::dvec3> tip_of(const std::string& text);

/// Guides the user from the search for a headset to a stored and checked calibration; returns the
/// exit code. Call it on the main thread, before others are started.
int run_calibrate(const CalibrateCommand& command);

}  // namespace palpate::app
