#pragma once

#include <limits>
#include <memory>
#include <string>

#include "compute/volume/result.h"
#include "integration/devices/simulated.h"
#include "module/session/loaded_scene.h"

namespace palpate::sessions {

/// What a simulated hand does, and how it holds its device.
struct HandChoice {
  std::string hand = "human";  ///< human, loose, firm, none
  std::string path = "press";  ///< press, tap, stroke, circle, sweep, or a file of t_s,x_m,y_m,z_m
  double lets_go_at_s = std::numeric_limits<double>::infinity();
};

struct SimulatedHand {
  std::unique_ptr<devices::SimulatedDevice> device;
  double path_s = 0.0;   ///< how long its path takes
  std::string sentence;  ///< which path it follows
};

/// A simulated device whose hand follows a path that touches the scene; where there is no surface
/// to press it goes round in circles. While motion is awaited it goes on. fit: the scene is made to
/// fit the device's reach first, see fit_to_reach(). kBadInput in one sentence. Any thread.
Result<SimulatedHand> simulated_hand(const HandChoice& choice, LoadedScene& scene, bool fit);

}  // namespace palpate::sessions
