#pragma once

#include <array>
#include <memory>
#include <span>

#include "module/haptics/guard/energy.h"
#include "module/haptics/guard/force_bridge.h"
#include "module/haptics/guard/safety.h"
#include "module/haptics/proxy/delay_lead.h"
#include "module/haptics/proxy/haptic_run.h"
#include "module/haptics/proxy/sweep.h"
#include "module/haptics/proxy/velocity.h"
#include "module/haptics/scene/scene_snapshot.h"
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
/// A tool of n points does this for each, as if it were the whole tool; the springs share the
/// stiffness. So the force is the mean of the points' forces, and the torque that of
///   (point - device's position) x force of the point.
/// The points turn with the grip where the device senses it, else with the device's axes.
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
  /// Of the last tick.
  PointsSnapshot points() const noexcept;
  const EnergyTank& tank() const { return tank_; }
  /// The stiffness, N/m in the world, that is used on this device: the scene's, but no more than
  /// the device holds without humming. Any thread.
  double stiffness_on_device(const Scene& scene, double wanted_n_per_m) const noexcept;

 private:
  /// One point of the tool: what outlives an exchange of the scene. Space: world.
  struct Tip {
    glm::dvec3 lever_m{0.0};  ///< from the device's position to it
    glm::dvec3 probe_m{0.0}, proxy_m{0.0};
    /// How far the probe went since the last frame, and how far of that by a turn of the grip for
    /// which the hand feels nothing: the device gives no torque.
    glm::dvec3 step_m{0.0}, turned_m{0.0};
    /// Of a tool that is only this point: what is felt, and what of the spring the tank did not pay
    /// for.
    glm::dvec3 felt_n{0.0}, slipped_n{0.0};
    double drag_n_s_per_m = 0.0;  ///< of the material in the last frame
    ForceBridge bridge;
  };

  glm::dvec3 read(const DeviceReading& reading, double dt_s) noexcept;
  void control(const TickInput& input) noexcept;
  void change_tool() noexcept;
  void move_probes() noexcept;
  void place_proxies() noexcept;
  void move_on(const TickInput& input, double dt_s) noexcept;
  Cause report(TickOutput& out) const noexcept;
  glm::dvec3 bridged_n() const noexcept;
  void account(ForceLedger& ledger) const noexcept;
  Sweep move_proxies(double dt_s) noexcept;
  glm::dvec3 force_n(const TickInput& input, double dt_s) noexcept;
  void add_torque(SafetyInput& guard) const noexcept;
  std::span<Tip> tips() noexcept { return {tips_.data(), tip_count_}; }
  std::span<const Tip> tips() const noexcept { return {tips_.data(), tip_count_}; }
  /// The mean over the points: exactly the value of the only one.
  template <class Of>
  glm::dvec3 mean(Of of) const noexcept {
    glm::dvec3 sum = of(tips_[0]);
    for (size_t i = 1; i < tip_count_; ++i) sum += of(tips_[i]);
    return sum / double(tip_count_);
  }

  HapticsOptions options_;
  Safety safety_;
  EnergyTank tank_;
  double most_stiffness_n_per_m_;  ///< of the device; infinite: not known
  bool gives_torque_;
  DelayLead lead_;
  VelocityEstimate hand_, device_hand_, point_;
  std::unique_ptr<HapticRun> run_;
  std::array<Tip, kMostToolPoints> tips_;
  size_t tip_count_ = 1;
  glm::dquat device_from_grip_{1.0, 0.0, 0.0, 0.0};  ///< as last sensed
  glm::dvec3 probe_{0.0};  ///< of the device, world, predicted; the last good one
  glm::dvec3 last_wanted_{0.0};
  bool placed_ = false;  ///< the proxies have been put to their probes
  bool empty_ = true;
  Transform device_;     ///< world from device of the scene that ran last
  double lost_s_ = 0.0;  ///< how long the device has given no position to trust
};

}  // namespace palpate
