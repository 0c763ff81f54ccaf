#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

#include "module/haptics/cause.h"
#include "module/haptics/device.h"
#include "module/haptics/force_ledger.h"
#include "module/haptics/guard/guards.h"
#include "module/haptics/guard/oscillation.h"

namespace palpate {

/// The limits of what may reach a hand. Defaults suit a Falcon-sized device. A value that makes no
/// sense (not finite, not above 0 where 0 has no meaning) counts as its default.
struct SafetyOptions {
  double max_force_n = 4.0;          ///< and never more than the device's most
  double max_slew_n_per_s = 2000.0;  ///< of every change
  double off_ramp_s = 0.020;         ///< to zero after any cause; longer if the slew asks for it
  double start_force_n = 0.2;        ///< start gate: the wanted force must be below this ...
  int start_frames = 3;              ///< ... for so many frames ...
  double start_ramp_s = 2.0;         ///< ... then it is let in over this time ...
  double start_damping = 0.2;        ///< ... with this share of max_damping, fading with the ramp
  double max_damping_n_s_per_m = 5.0;
  double max_speed_m_per_s = 1.5;  ///< above: damp; twice that for too_fast_s: off
  double too_fast_s = 0.020;
  double edge_m = 0.004;                 ///< the force fades over this at the end of the workspace
  double first_contact_n_per_s = 200.0;  ///< slew while a contact is younger than first_contact_s
  double first_contact_s = 0.010;        ///< 0: no such guard
  double return_n_per_s = 50.0;          ///< at which the limit on returned energy acts
  double buzz_n = 0.3;                   ///< oscillation guard: rms of the force from 20 to 300 Hz
  /// thermal model: what the motors can hold for ever; 0: what the device states, and no such model
  /// where it states nothing
  double continuous_force_n = 0.0;
  double thermal_s = 60.0;          ///< its time constant
  double late_s = 0.005;            ///< watchdog: a frame as long as this is late
  double stale_s = 0.020;           ///< without a new position for so long: a fault of the device
  bool dead_man = false;            ///< a button must be held
  uint32_t dead_man_buttons = ~0u;  ///< any of these
  uint32_t shown_buttons = 0;  ///< one of these says that a viewer shows the scene; 0: not needed
  /// energy gate: power given to the hand beyond what it gave back; 0: 2 W
  double max_power_w = 0.0;
  double burst_j = 0.5;  ///< what may be given at once
};

/// What one haptic frame asks of the guards. Space: the device's, m and N.
struct SafetyInput {
  glm::dvec3 wanted_n{0.0};  ///< the scene's force
  /// About the device's position, and how far from it the forces act, m. 0: there is no torque.
  glm::dvec3 wanted_torque_n_m{0.0};
  double lever_m = 0.0;
  DeviceReading reading;
  glm::dvec3 velocity_m_per_s{0.0};
  double dt_s = 1e-3;     ///< since the last frame, as measured
  bool late = false;      ///< the loop missed its deadline by too much
  bool stop = false;      ///< go to zero and stay there
  bool rearm = false;     ///< after kStopped, kOscillation or kShaking: a person says go on
  bool touching = false;  ///< some primitive holds the proxy
  double stiffness_n_per_m = 0.0;  ///< of the spring that gives wanted_n; 0: not a spring's force
  Cause scene = Cause::kNone;      ///< what the scene has faded already: reported, not acted on
};

enum class SafetyState : uint8_t {
  kOff,      ///< zero: something is not as it must be (the cause says what)
  kWaiting,  ///< zero: all is well, the hand must come free
  kRamping,  ///< the force comes up
  kOn,
  kFading,   ///< on the ramp to zero
  kTripped,  ///< zero, until a person rearms
};

/// What may reach the hand.
struct SafetyOutput {
  glm::dvec3 force_n{0.0};
  glm::dvec3 torque_n_m{0.0};
  SafetyState state = SafetyState::kWaiting;
  Cause cause = Cause::kStarting;
  bool in_contact = false;
  double work_j = 0.0;  ///< that all forces so far did on the hand; negative: the hand worked
  /// From SafetyInput::wanted_n, as asked_n, to force_n. The scene's limiters have no part in it.
  ForceLedger ledger;
};

/// All limits between the scene's force and a human hand.
///
/// Off-causes: stop, oscillation, device fault or no new position, a value that is not finite, a
/// clock that stands, goes back or jumps by a second, a late frame, far too fast, dead-man, unseen.
/// In the first frame that has one, the force begins a straight ramp from the last force to zero.
/// The ramp uses nothing of the input, so garbage can not disturb it. The first cause is latched;
/// after the ramp the reported cause is the one that is still present. Then comes the start gate.
/// After kStopped, kOscillation and kShaking a person has to say go on (rearm); after all others it
/// is enough that the hand is free.
///
/// Limits, while on: start ramp and damping, gain of the oscillation guard, damping above the
/// velocity limit, workspace edge; then always in this order: finite, magnitude (also the motors'
/// heat), slew (slower at a first contact), energy. A tenth of the slew is reserved for the changes
/// that the energy gate makes, so that all changes together stay within it.
///
/// No step is larger than max_slew * dt, where dt is that of the frame, at most 2 ms (and 1 ms
/// where the clock is to blame: below 1 us or not a number). After a gap the force changes by no
/// more than in any other frame, and the ramp takes at least ten frames.
///
/// A torque passes the same limits as a force at the end of its lever would (start, buzz,
/// magnitude, heat, return, first contact, slew, power, off ramp), and is cut at the most that the
/// device can give. Of a device that gives none it is only told.
///
/// A value; step() is real-time safe and its result depends on the inputs alone. One thread.
class Safety {
 public:
  Safety(const SafetyOptions& options, const DeviceInfo& device) noexcept;
  /// Call it once per haptic frame in every state, since it also integrates heat and energy.
  SafetyOutput step(const SafetyInput& input) noexcept;
  /// The options as used.
  const SafetyOptions& options() const noexcept { return options_; }

 private:
  void account(const SafetyInput& input, double dt_s) noexcept;
  uint32_t off_causes(const SafetyInput& input, double dt_s) noexcept;
  void advance(const SafetyInput& input, uint32_t off, double dt_s) noexcept;
  void latch(uint32_t off) noexcept;
  void limit_torque(const SafetyInput& input, double gain, double most_n, double kept,
                    double rising_n_per_s, double dt_s) noexcept;
  glm::dvec3 limited(const SafetyInput& input, double dt_s, ForceLedger& ledger) noexcept;
  glm::dvec3 damping(glm::dvec3 velocity) noexcept;
  glm::dvec3 faded_at_edge(glm::dvec3 force, glm::dvec3 position) noexcept;
  Cause shaking() const noexcept {
    return oscillation_.is_scenes() ? Cause::kShaking : Cause::kOscillation;
  }
  bool active() const noexcept {
    return state_ == SafetyState::kRamping || state_ == SafetyState::kOn;
  }

  SafetyOptions options_;
  glm::dvec3 centre_m_;
  double radius_m_;
  MotorHeat heat_;
  PowerGate power_;
  FirstContact contact_;
  PassiveReturn return_;
  OscillationGuard oscillation_;

  SafetyState state_ = SafetyState::kWaiting;
  Cause latched_ = Cause::kStarting;
  Cause limit_ = Cause::kNone;  // the strongest limit at work in this frame
  Cause slow_ = Cause::kNone;   // why the last frame's force rose slowly
  uint32_t needs_person_ = 0;   // off-causes that stay until rearmed
  double ramp_ = 0.0;           // share of the start ramp that is done
  double fade_ = 0.0;           // share of the off ramp that is left
  int free_frames_ = 0;
  double work_j_ = 0.0;  // on the hand, since the start
  double fast_s_ = 0.0, stale_s_ = 0.0;
  glm::dvec3 fade_from_{0.0}, slewed_{0.0}, force_{0.0};
  // The same of the torque. lever_m_: the last that was not 0.
  glm::dvec3 fade_torque_n_m_{0.0}, slewed_torque_n_m_{0.0}, torque_n_m_{0.0};
  double lever_m_ = 0.0, most_torque_n_m_ = 0.0;
  glm::dvec3 last_wanted_{0.0};  // behind magnitude, before slew
  glm::dvec3 last_position_{0.0};
  bool has_position_ = false;
};

}  // namespace palpate
