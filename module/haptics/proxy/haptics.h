#pragma once

#include <memory>

#include "module/haptics/guard/energy.h"
#include "module/haptics/guard/force_bridge.h"
#include "module/haptics/guard/safety.h"
#include "module/haptics/proxy/delay_lead.h"
#include "module/haptics/proxy/haptic_run.h"
#include "module/haptics/proxy/sweep.h"
#include "module/haptics/proxy/velocity.h"
#include "module/haptics/ticker.h"

namespace palpate {

/// How the hand is coupled, beyond what the scene says.
struct HapticsOptions {
  SafetyOptions safety;
  EnergyTankOptions tank;
  bool meter_energy = true;  ///< off: for experiments with a simulated hand only
  /// of the loop; with the device's delay it determines how far ahead the probe is predicted
  double period_s = 1e-3;
  /// predict the probe to compensate a part of sampling and delay; see DelayLead
  bool lead = true;
};

/// The haptic step: one frame of the method, section 6 (the paper's Fig. 13), for any number of
/// volumes, modes and motions:
///   poses and time go on; each carrier takes its material point along; the proxy is swept to its
///   balance; the energy tank says how much of that the scene may; the spring's force, behind the
///   guards, goes to the device.
/// What limits the force on its way, in this order (docs/force-limits.md): ramp (HapticRun::ramp),
/// confidence (Carrier::place), fade (CarrierRun::follow_to), tank (EnergyTank), bridge
/// (ForceBridge), guards (Safety). What a scene does not have costs nothing: no pose for a volume
/// that stands still, no phase for a single frame.
class Haptics final : public Ticker {
 public:
  Haptics(const HapticsOptions& options, const DeviceInfo& device);

  /// Makes a scene ready to run. Allocates: any thread but the servo's.
  static std::unique_ptr<HapticRun> prepare(std::shared_ptr<const Scene> scene);

  /// Runs another scene from the next tick on, without a step of the force: what differs fades
  /// over. Returns the one that ran before (null at first), to be deleted off the servo thread.
  /// Real-time safe.
  std::unique_ptr<HapticRun> adopt(std::unique_ptr<HapticRun> next) noexcept;

  TickOutput tick(const TickInput& input) noexcept override;

  const HapticRun* run() const { return run_.get(); }
  const EnergyTank& tank() const { return tank_; }
  /// The stiffness, N/m in the world, that is used on this device: the scene's, but no more than
  /// the device holds without humming. Any thread.
  double stiffness_on_device(const Scene& scene, double wanted_n_per_m) const noexcept;

 private:
  glm::dvec3 read(const DeviceReading& reading, double dt_s) noexcept;
  void control(const TickInput& input) noexcept;
  void move_on(const TickInput& input, double dt_s) noexcept;
  Cause report(TickOutput& out) const noexcept;
  void account(ForceLedger& ledger) const noexcept;
  Sweep move_proxy(glm::dvec3 probe, double dt_s) noexcept;
  glm::dvec3 spring_n(glm::dvec3 probe, glm::dvec3 proxy_velocity,
                      glm::dvec3 probe_velocity) const noexcept;
  glm::dvec3 force_n(glm::dvec3 probe, const TickInput& input, double dt_s) noexcept;

  HapticsOptions options_;
  Safety safety_;
  EnergyTank tank_;
  double most_stiffness_n_per_m_;  ///< of the device; infinite: not known
  DelayLead lead_;
  VelocityEstimate hand_, device_hand_, point_;
  std::unique_ptr<HapticRun> run_;
  glm::dvec3 proxy_{0.0};       ///< world
  glm::dvec3 last_probe_{0.0};  ///< world, predicted; the last good one
  glm::dvec3 last_wanted_{0.0};
  glm::dvec3 slipped_n_{0.0};    ///< world: of the spring, what the tank did not pay for
  double drag_n_s_per_m_ = 0.0;  ///< of the material in the last frame
  ForceBridge bridge_;
  bool placed_ = false;  ///< proxy_ has been put to a probe
  bool empty_ = true;
  Transform device_;     ///< world from device of the scene that ran last
  double lost_s_ = 0.0;  ///< how long the device has given no position to trust
};

}  // namespace palpate
