#pragma once

#include <limits>
#include <memory>
#include <string>

#include "compute/volume/result.h"
#include "integration/devices/simulated.h"
#include "module/haptics/servo/servo_clock.h"
#include "module/session/loaded_scene.h"

namespace palpate::running {

/// What a simulated hand does, and how stiffly it holds the device.
struct HandChoice {
  std::string hand = "human";  ///< human, loose, firm, none
  std::string path = "press";  ///< press, tap, stroke, circle, sweep, or a file of t_s,x_m,y_m,z_m
  double lets_go_at_s = std::numeric_limits<double>::infinity();
  ServoClock* clock = nullptr;  ///< whose time it has; null: the monotonic clock
};

struct SimulatedHand {
  std::unique_ptr<devices::SimulatedDevice> device;
  double path_s = 0.0;   ///< duration of its path
  std::string sentence;  ///< which path it follows, for the user
};

/// A simulated device whose hand follows a path that touches the scene, or circles if there is no
/// surface to press. While motion is being estimated it continues. fit: first scale the scene to
/// the device's reach, see fit_to_reach(). Errors: kBadInput with one sentence. Any thread.
Result<SimulatedHand> simulated_hand(const HandChoice& choice, LoadedScene& scene, bool fit);

}  // namespace palpate::running
