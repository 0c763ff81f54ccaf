#pragma once

#include <array>
#include <limits>
#include <memory>
#include <vector>

#include "module/haptics/guard/force_bridge.h"
#include "module/haptics/proxy/balance.h"
#include "module/haptics/proxy/carrier.h"
#include "module/haptics/proxy/placed.h"
#include "module/haptics/scene/scene.h"

namespace palpate {

/// How a mode stands while it runs.
struct ModeRun {
  double weight = 1.0;  ///< follows `on` in a ramp, so that switching is no step
  double gain = 1.0;
  double wanted_gain = 1.0;
  bool on = true;
  double wanted_weight() const { return on ? 1.0 : 0.0; }
  bool ramps() const { return weight != wanted_weight() || gain != wanted_gain; }
};

/// How it stands at a point of the tool.
struct PointMode {
  double placed_n = 0.0;    ///< strongest of what it placed last, before weight and gain
  bool on_surface = false;  ///< the proxy rests on its surface, and has not been pressed through it
  double iso_value = 0.0;   ///< the data's value where it was met
};

/// A carrier, and the fade of its force while its point can not be found: the point is frozen and
/// the force faded over 20 ms, but no faster than kFade_n_per_s. When the point is found again the
/// force comes back as slowly.
struct CarrierRun {
  std::unique_ptr<Carrier> carrier;
  double fade = 1.0;
  /// no primitive pushes harder than the force did when it was lost
  double cap_n = std::numeric_limits<double>::infinity();
  bool frozen = false;        ///< in this haptic frame
  glm::dvec3 carried_m{0.0};  ///< how far the material took the proxy in this haptic frame, world
  /// where the proxy of the last haptic frame is now, if it moves with the material; world
  glm::dvec3 material_m{0.0};

  /// Moves the carrier to the proxy at the end of the frame and continues its fade; felt_n is the
  /// force on the hand. Real-time safe.
  void follow_to(glm::dvec3 proxy, double felt_n, double dt_s) noexcept;
};

/// What a point of the tool has of its own: its proxy is carried, swept and balanced as if it were
/// the whole tool.
struct PointRun {
  std::vector<CarrierRun> carriers;  ///< as Scene::carriers
  std::vector<PointMode> modes;      ///< as Scene::modes
  BalanceHint hint;                  ///< of the sweep's last balance
  double drag_n_s_per_m = 0.0;       ///< of the material, as the last sweep found it
  std::vector<ForceBridge::MaterialStep> material_steps;  ///< of the carriers, for the bridge

  /// Puts every carrier at the material point that is at `world`; where it can not be found the
  /// carrier starts faded out. Real-time safe.
  void place_proxy(glm::dvec3 world) noexcept;
};

/// The state of a running scene: everything that changes from one haptic frame to the next. Made by
/// prepare() off the servo thread with all its memory; the frames themselves allocate nothing.
struct HapticRun {
  std::shared_ptr<const Scene> scene;
  std::vector<VolumeRun> volumes;
  std::vector<PointRun> points;  ///< as Scene::points_m
  std::vector<ModeRun> modes;
  /// volumes whose transform may change; only their poses are computed
  std::vector<int> posed;
  std::vector<int> playing;  ///< volumes with more than one frame: the only ones whose time goes on
  double time_s = 0.0;       ///< since the start; drives the scripted transforms
  double stiffness_n_per_m = 0.0;
  double wanted_stiffness_n_per_m = 0.0;
  /// of a sweep: kept here, since clearing it in each frame would cost more than using it
  std::array<Placed, 3> scratch;

  /// Everything at its start, proxies to be set with place_proxy(). Allocates.
  explicit HapticRun(std::shared_ptr<const Scene> scene);
  HapticRun(const HapticRun&) = delete;
  HapticRun& operator=(const HapticRun&) = delete;

  /// Takes over pose, playback and switches from `before` for volumes and modes of the same name.
  /// New modes come in as if they were switched on now. A volume that stands still in both scenes
  /// is where the new scene puts it. Real-time safe.
  void take_over(const HapticRun& before) noexcept;
  /// Moves switches, gains and the stiffness towards their wanted values, so that the force changes
  /// by at most kRamp_n_per_s; felt_n is the force on the hand now. Real-time safe.
  void ramp(double dt_s, double felt_n) noexcept;
};

}  // namespace palpate
