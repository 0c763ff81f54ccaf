#pragma once

#include <array>
#include <limits>
#include <memory>
#include <vector>

#include "module/haptics/carrier.h"
#include "module/haptics/haptic_scene.h"
#include "module/haptics/placed.h"

namespace palpate {

/// How a mode stands while it runs.
struct ModeRun {
  double weight = 1.0;  ///< follows `on` in a ramp, so that switching is no step
  double gain = 1.0;
  double wanted_gain = 1.0;
  bool on = true;
  bool on_level = false;  ///< the proxy rests on its surface, and has not been pressed through it
  double level = 0.0;     ///< the data's value where it was met
};

/// A carrier, and what is left of its force when its point could not be found: held, then faded.
struct CarrierRun {
  std::unique_ptr<Carrier> carrier;
  double fade = 1.0;
  double cap_n = std::numeric_limits<double>::infinity();  ///< no primitive pushes harder than the
                                                           ///< force did when it was lost
  bool held = false;                                       ///< in this haptic frame
};

/// A scene as it runs: everything that changes from one haptic frame to the next. Made by prepare()
/// off the servo thread with all its memory; the frames themselves allocate nothing.
struct HapticRun {
  std::shared_ptr<const HapticScene> scene;
  std::vector<VolumeRun> volumes;
  std::vector<CarrierRun> carriers;
  std::vector<ModeRun> modes;
  std::vector<int>
      posed;  ///< volumes whose transform may change: the only ones whose pose is asked for
  std::vector<int> playing;  ///< volumes with more than one frame: the only ones whose time goes on
  double time_s = 0.0;       ///< since the start; drives the scripted transforms
  double stiffness_n_per_m = 0.0;
  double wanted_stiffness_n_per_m = 0.0;
  std::array<Placed, 3>
      scratch;  ///< of the sweep: kept here because to clear it would cost more than to use it

  /// Everything at its start, proxy to be set with place_proxy(). Allocates.
  explicit HapticRun(std::shared_ptr<const HapticScene> scene);
  HapticRun(const HapticRun&) = delete;
  HapticRun& operator=(const HapticRun&) = delete;

  /// Goes on where `before` is for volumes and modes of the same name: pose, playback, switches.
  /// Real-time safe.
  void take_over(const HapticRun& before) noexcept;
  /// Makes the material at `world` the proxy in every volume; where it can not be found the carrier
  /// starts faded out. Real-time safe.
  void place_proxy(glm::dvec3 world) noexcept;
};

}  // namespace palpate
