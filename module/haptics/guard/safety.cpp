#include "module/haptics/guard/safety.h"

#include <algorithm>
#include <cmath>

#include "module/haptics/force_vector.h"

namespace palpate {
namespace {

constexpr double kShortestFrameS = 1e-6;  // shorter: the clock stands still
constexpr double kUsualFrameS = 1e-3;     // stands in for a dt that is none
constexpr double kLongestFrameS = 2e-3;   // a longer one counts as this: see Safety
constexpr double kJumpS = 1.0;            // longer: the clock was set, this is not a delay
constexpr double kEnergyShare = 0.1;      // of the slew, kept for the energy gate
constexpr double kUsualPowerW = 2.0;
constexpr double kFar = 2.0;         // times the velocity limit: far too fast
constexpr double kSaidN = 0.005;     // less than this held back is not reported
constexpr double kHandStepM = 0.02;  // no hand moves further in a frame: 10 m/s for 2 ms

constexpr uint32_t bit(Cause cause) {
  return 1u << unsigned(cause);
}
constexpr uint32_t kForPeople =
    bit(Cause::kStopped) | bit(Cause::kOscillation) | bit(Cause::kShaking);
// In the order in which they are reported where several hold.
constexpr Cause kOffCauses[] = {
    Cause::kStopped, Cause::kOscillation, Cause::kShaking, Cause::kDevice, Cause::kNotFinite,
    Cause::kClock,   Cause::kLate,        Cause::kTooFast, Cause::kUnseen, Cause::kDeadMan};

Cause first(uint32_t off) noexcept {
  for (Cause cause : kOffCauses)
    if (off & bit(cause)) return cause;
  return Cause::kNone;
}

double above_zero(double value, double otherwise) noexcept {
  return value > 0.0 && std::isfinite(value) ? value : otherwise;
}

double not_negative(double value, double otherwise) noexcept {
  return value >= 0.0 && std::isfinite(value) ? value : otherwise;
}

SafetyOptions sensible(SafetyOptions o, const DeviceInfo& device) noexcept {
  const SafetyOptions usual;
  o.max_force_n = above_zero(o.max_force_n, usual.max_force_n);
  const double device_n = above_zero(device.max_force_n, o.max_force_n);
  o.max_force_n = std::min(o.max_force_n, device_n);
  o.max_slew_n_per_s = above_zero(o.max_slew_n_per_s, usual.max_slew_n_per_s);
  o.off_ramp_s =
      std::max(above_zero(o.off_ramp_s, usual.off_ramp_s), o.max_force_n / o.max_slew_n_per_s);
  o.start_force_n = above_zero(o.start_force_n, usual.start_force_n);
  o.start_frames = std::max(o.start_frames, 1);
  o.start_ramp_s = above_zero(o.start_ramp_s, usual.start_ramp_s);
  o.start_damping = std::min(not_negative(o.start_damping, usual.start_damping), 1.0);
  o.max_damping_n_s_per_m = not_negative(o.max_damping_n_s_per_m, usual.max_damping_n_s_per_m);
  o.max_speed_m_per_s = above_zero(o.max_speed_m_per_s, usual.max_speed_m_per_s);
  o.too_fast_s = not_negative(o.too_fast_s, usual.too_fast_s);
  o.edge_m = not_negative(o.edge_m, usual.edge_m);
  o.first_contact_n_per_s = above_zero(o.first_contact_n_per_s, usual.first_contact_n_per_s);
  o.first_contact_s = not_negative(o.first_contact_s, usual.first_contact_s);
  o.return_n_per_s = above_zero(o.return_n_per_s, usual.return_n_per_s);
  o.buzz_n = above_zero(o.buzz_n, usual.buzz_n);
  // Motors that hold the most for ever are never too hot for it.
  o.continuous_force_n =
      above_zero(o.continuous_force_n, above_zero(device.continuous_force_n, o.max_force_n));
  o.thermal_s = above_zero(o.thermal_s, usual.thermal_s);
  o.late_s = above_zero(o.late_s, usual.late_s);
  o.stale_s = above_zero(o.stale_s, usual.stale_s);
  o.max_power_w = above_zero(o.max_power_w, kUsualPowerW);
  o.burst_j = above_zero(o.burst_j, usual.burst_j);
  return o;
}

}  // namespace

Safety::Safety(const SafetyOptions& options, const DeviceInfo& device) noexcept
    : options_(sensible(options, device)),
      centre_m_(is_finite(device.workspace_centre_m) ? device.workspace_centre_m : glm::dvec3(0.0)),
      radius_m_(above_zero(device.workspace_radius_m, 0.0)),
      heat_(options_.continuous_force_n, options_.max_force_n, options_.thermal_s),
      power_(options_.max_power_w, options_.burst_j,
             kEnergyShare * options_.max_slew_n_per_s / options_.max_force_n),
      contact_(options_.first_contact_n_per_s, options_.first_contact_s),
      return_(options_.return_n_per_s),
      oscillation_(options_.buzz_n),
      most_torque_n_m_(above_zero(device.max_torque_n_m, 0.0)) {}

SafetyOutput Safety::step(const SafetyInput& input) noexcept {
  // NaN compares false and is replaced too.
  const double dt =
      input.dt_s >= kShortestFrameS ? std::min(input.dt_s, kLongestFrameS) : kUsualFrameS;
  account(input, dt);
  const uint32_t off = off_causes(input, dt);
  advance(input, off, dt);

  limit_ = Cause::kNone;
  SafetyOutput out;
  if (is_finite(input.wanted_n)) out.ledger.asked_n = input.wanted_n;
  if (active()) {
    force_ = limited(input, dt, out.ledger);
  } else {
    slewed_ = slewed_torque_n_m_ = glm::dvec3(0.0);
    last_wanted_ = glm::dvec3(0.0);
    slow_ = Cause::kNone;
    return_ = PassiveReturn(options_.return_n_per_s);
    force_ = state_ == SafetyState::kFading ? fade_ * fade_from_ : glm::dvec3(0.0);
    torque_n_m_ = state_ == SafetyState::kFading ? fade_ * fade_torque_n_m_ : glm::dvec3(0.0);
    out.ledger[Limiter::kOff] = out.ledger.asked_n - force_;
  }

  out.force_n = force_;
  out.torque_n_m = torque_n_m_;
  out.state = state_;
  out.in_contact = active() && input.touching;
  out.work_j = work_j_;
  out.cause = latched_;
  if (active()) {
    out.cause = limit_ != Cause::kNone            ? limit_
                : state_ == SafetyState::kRamping ? Cause::kStarting
                                                  : input.scene;
  }
  return out;
}

// What the last force did since the last frame: heat in the motors, work on the hand, sound.
void Safety::account(const SafetyInput& input, double dt_s) noexcept {
  const double applied_s =
      input.dt_s >= kShortestFrameS ? std::min(input.dt_s, kJumpS) : kUsualFrameS;
  heat_.step(length_of(force_), applied_s);
  const DeviceReading& reading = input.reading;
  double work_j = 0.0;
  if (reading.fault == DeviceFault::kNone && is_finite(reading.position_m)) {
    const glm::dvec3 moved = reading.position_m - last_position_;
    if (has_position_ && is_finite(moved)) {
      const glm::dvec3 way = shortened(moved, kHandStepM);
      work_j = glm::dot(force_, way);
      if (most_torque_n_m_ > 0.0 && reading.grip.turns)
        work_j += dt_s * glm::dot(torque_n_m_, reading.grip.angular_velocity_rad_per_s);
      return_.move(-glm::dot(last_wanted_, way), -glm::dot(slewed_, way));
    }
    last_position_ = reading.position_m;
    has_position_ = true;
  } else {
    has_position_ = false;  // what comes next may be another place
  }
  work_j_ += work_j;
  power_.step(work_j, dt_s);
  contact_.step(input.touching, dt_s);
  if (input.rearm) oscillation_.reset();
  oscillation_.step(force_, input.stiffness_n_per_m * last_position_, dt_s);
}

uint32_t Safety::off_causes(const SafetyInput& input, double dt_s) noexcept {
  const DeviceReading& reading = input.reading;
  uint32_t off = 0;
  stale_s_ = reading.fresh ? 0.0 : std::min(stale_s_ + dt_s, 1e3);
  if (reading.fault != DeviceFault::kNone || stale_s_ > options_.stale_s)
    off |= bit(Cause::kDevice);
  if (!is_finite(input.wanted_n) || !is_finite(input.wanted_torque_n_m) ||
      !is_finite(reading.position_m) || !is_finite(input.velocity_m_per_s))
    off |= bit(Cause::kNotFinite);
  if (!(input.dt_s >= kShortestFrameS && input.dt_s <= kJumpS))
    off |= bit(Cause::kClock);
  else if (input.late || input.dt_s >= options_.late_s)
    off |= bit(Cause::kLate);
  const bool far = is_finite(input.velocity_m_per_s) &&
                   length_of(input.velocity_m_per_s) > kFar * options_.max_speed_m_per_s;
  // At most twice the time, so that it takes no longer to forget than to trip.
  fast_s_ = std::clamp(fast_s_ + (far ? dt_s : -dt_s), 0.0, 2.0 * options_.too_fast_s);
  if (far && fast_s_ > options_.too_fast_s) off |= bit(Cause::kTooFast);
  if (options_.dead_man && (reading.buttons & options_.dead_man_buttons) == 0)
    off |= bit(Cause::kDeadMan);
  if (options_.shown_buttons != 0 && (reading.buttons & options_.shown_buttons) == 0)
    off |= bit(Cause::kUnseen);
  if (input.rearm) needs_person_ = 0;
  if (input.stop) needs_person_ |= bit(Cause::kStopped);
  if (oscillation_.tripped()) needs_person_ |= bit(shaking());
  return off | needs_person_;
}

void Safety::latch(uint32_t off) noexcept {
  // The first cause stays as long as it is present; then one that is present now.
  if (off != 0 && !(off & bit(latched_))) latched_ = first(off);
}

void Safety::advance(const SafetyInput& input, uint32_t off, double dt_s) noexcept {
  if (active() && off != 0) {
    latched_ = first(off);
    state_ = SafetyState::kFading;
    fade_from_ = force_;
    fade_torque_n_m_ = torque_n_m_;
    fade_ = 1.0;
  }
  switch (state_) {
    case SafetyState::kFading:
      fade_ = std::max(0.0, fade_ - dt_s / options_.off_ramp_s);
      if (fade_ > 0.0) return;
      [[fallthrough]];
    case SafetyState::kOff:
    case SafetyState::kTripped:
    case SafetyState::kWaiting: {
      latch(off);
      const SafetyState before = state_;
      state_ = off & kForPeople ? SafetyState::kTripped
               : off != 0       ? SafetyState::kOff
                                : SafetyState::kWaiting;
      if (state_ != SafetyState::kWaiting || before != SafetyState::kWaiting) free_frames_ = 0;
      if (state_ != SafetyState::kWaiting) return;
      free_frames_ = length_of(input.wanted_n) < options_.start_force_n ? free_frames_ + 1 : 0;
      if (free_frames_ < options_.start_frames) return;
      state_ = SafetyState::kRamping;
      latched_ = Cause::kStarting;
      ramp_ = 0.0;
      return;
    }
    case SafetyState::kRamping:
      ramp_ += dt_s / options_.start_ramp_s;
      if (ramp_ >= 1.0) state_ = SafetyState::kOn;
      return;
    case SafetyState::kOn:
      return;
  }
}

// Against the velocity: with the start ramp, and above the velocity limit.
glm::dvec3 Safety::damping(glm::dvec3 velocity) noexcept {
  const double speed = length_of(velocity);
  const double excess = std::max(0.0, speed - options_.max_speed_m_per_s);
  if (excess > 0.0) limit_ = Cause::kTooFast;
  // Comes up over the first tenth of the ramp, then fades with it: no step at either end.
  const double share = state_ == SafetyState::kRamping
                           ? options_.start_damping * std::min(10.0 * ramp_, 1.0) * (1.0 - ramp_)
                           : 0.0;
  const double newton =
      std::min(options_.max_damping_n_s_per_m * (share * std::min(speed, 1e3) + excess),
               options_.max_force_n);
  return speed > 0.0 ? -newton * (velocity / speed) : glm::dvec3(0.0);
}

// Only the part that points outwards fades: it would drive the grip into the device's stop, where
// its arms can not give the force they are asked for. What points inwards leads away from there;
// fading it too would take away a wall just where the hand leans on it, and let the hand fall
// against the stop. What runs along the edge does neither.
glm::dvec3 Safety::faded_at_edge(glm::dvec3 force, glm::dvec3 position) noexcept {
  if (!(radius_m_ > 0.0) || !(options_.edge_m > 0.0)) return force;
  const glm::dvec3 arm = position - centre_m_;
  const double distance = length_of(arm);
  const double left = std::clamp((radius_m_ - distance) / options_.edge_m, 0.0, 1.0);
  if (left >= 1.0 || !(distance > 0.0)) return force;
  const glm::dvec3 outward = arm / distance;
  const double part = glm::dot(force, outward);
  if (!(part > 0.0)) return force;
  if (limit_ == Cause::kNone) limit_ = Cause::kWorkspaceEdge;
  return force - (1.0 - left) * part * outward;
}

// As a force at the end of the lever. kept: the share that the return leaves of the force.
void Safety::limit_torque(const SafetyInput& input, double gain, double most_n, double kept,
                          double rising_n_per_s, double dt_s) noexcept {
  if (input.lever_m > 0.0) lever_m_ = input.lever_m;
  const glm::dvec3 aim = kept * shortened(gain * shortened(input.wanted_torque_n_m,
                                                           10.0 * options_.max_force_n * lever_m_),
                                          most_n * lever_m_);
  const bool rises = length_of(aim) > length_of(slewed_torque_n_m_);
  const double full = (1.0 - kEnergyShare) * options_.max_slew_n_per_s;
  slewed_torque_n_m_ +=
      shortened(aim - slewed_torque_n_m_, (rises ? rising_n_per_s : full) * lever_m_ * dt_s);
  torque_n_m_ = power_.gain() * slewed_torque_n_m_;
  if (most_torque_n_m_ > 0.0) torque_n_m_ = shortened(torque_n_m_, most_torque_n_m_);
}

// The guards of docs/force-limits.md, in its order. What each holds back is the force before it
// minus the force behind it.
glm::dvec3 Safety::limited(const SafetyInput& input, double dt_s, ForceLedger& ledger) noexcept {
  // Start gate and buzz.
  if (oscillation_.gain() < 1.0) limit_ = shaking();
  const double gain =
      oscillation_.gain() * (state_ == SafetyState::kRamping ? std::min(ramp_, 1.0) : 1.0);
  // Cut once before anything is multiplied or added: what is huge stays finite. Ten times, so that
  // the guards in between still see what is wanted beyond the limit.
  const glm::dvec3 cut = shortened(input.wanted_n, 10.0 * options_.max_force_n);
  const glm::dvec3 quiet = oscillation_.gain() * cut, gained = gain * cut;
  ledger[Limiter::kOscillation] = cut - quiet;
  ledger[Limiter::kStart] = quiet - gained;
  // Damping and edge.
  const glm::dvec3 damped = gained + damping(input.velocity_m_per_s);
  const glm::dvec3 faded = faded_at_edge(damped, input.reading.position_m);
  ledger[Limiter::kDamping] = gained - damped;
  ledger[Limiter::kEdge] = damped - faded;
  // Finite, whatever the steps above did.
  glm::dvec3 wanted = faded;
  if (!is_finite(wanted)) {
    wanted = glm::dvec3(0.0);
    ledger.held_n = {};
    ledger[Limiter::kFinite] = cut;
  }
  // Magnitude and heat.
  const double most = std::min(options_.max_force_n, heat_.limit_n());
  const double wanted_n = length_of(wanted);
  if (most < options_.max_force_n && wanted_n > most && limit_ == Cause::kNone)
    limit_ = Cause::kHot;
  const glm::dvec3 full_n = shortened(wanted, options_.max_force_n);
  const glm::dvec3 force = shortened(wanted, most);
  ledger[Limiter::kMagnitude] = (input.wanted_n - cut) + (wanted - full_n);
  ledger[Limiter::kHeat] = full_n - force;
  // Return, first contact and slew.
  const double full = (1.0 - kEnergyShare) * options_.max_slew_n_per_s;
  const double rising = contact_.slew_n_per_s(full);
  const double allowed_n = length_of(force);
  const double returned_n = return_.most_n(wanted_n, allowed_n, input.stiffness_n_per_m, dt_s);
  const glm::dvec3 aim = shortened(force, returned_n);
  ledger[Limiter::kReturn] = force - aim;
  const bool rises = length_of(aim) > length_of(slewed_);
  const glm::dvec3 change = aim - slewed_;
  const Cause slow = rises && rising < full && length_of(change) > rising * dt_s
                         ? Cause::kFirstContact
                     : returned_n < allowed_n - kSaidN ? Cause::kReturn
                                                       : Cause::kNone;
  // The frame in which the force catches up has the same cause.
  if (limit_ == Cause::kNone) limit_ = slow == Cause::kNone && rises ? slow_ : slow;
  slow_ = slow;
  const glm::dvec3 at_full_slew = slewed_ + shortened(change, full * dt_s);
  slewed_ += shortened(change, (rises ? rising : full) * dt_s);
  ledger[Limiter::kSlew] = aim - at_full_slew;
  ledger[Limiter::kFirstContact] = at_full_slew - slewed_;
  return_.give(length_of(slewed_));
  last_wanted_ = force;
  limit_torque(input, gain, most, allowed_n > 0.0 ? std::min(1.0, returned_n / allowed_n) : 1.0,
               rising, dt_s);
  // Power.
  if (power_.gain() < 1.0 && limit_ == Cause::kNone) limit_ = Cause::kEnergy;
  const glm::dvec3 given = power_.gain() * slewed_;
  ledger[Limiter::kPower] = slewed_ - given;
  return given;
}

}  // namespace palpate
