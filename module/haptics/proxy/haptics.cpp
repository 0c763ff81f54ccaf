#include "module/haptics/proxy/haptics.h"

#include <algorithm>
#include <cmath>

#include "module/haptics/force_vector.h"
#include "module/scene/drive.h"

namespace palpate {
namespace {

// longer frames count as this long: lost time is not made up for in one jump
constexpr double kLongest_s = 0.010;

constexpr int kFirstRounds = 4;  // after which a slide from anywhere has come to its end

constexpr double kShortLoss_s = 0.5;  // a device lost for longer may have been put elsewhere

constexpr double kDoubtful = 0.35;  // a confidence below this has faded the force

// A world that enlarges the hand's movements makes every spring stiffer at the hand by as much.
double enlargement(const Scene& scene) {
  const glm::dvec3 scale = scene.world_from_device.scale;
  return std::max({scale.x, scale.y, scale.z});
}

}  // namespace

Haptics::Haptics(const HapticsOptions& options, const DeviceInfo& device)
    : options_(options),
      safety_(options.safety, device),
      tank_(options.tank),
      most_stiffness_n_per_m_(device.max_stiffness_n_per_m > 0.0
                                  ? device.max_stiffness_n_per_m
                                  : std::numeric_limits<double>::infinity()),
      lead_(options.period_s, options.lead ? device.delay_s : 0.0,
            options.lead ? DelayLead::kShare : 0.0) {}

double Haptics::stiffness_on_device(const Scene& scene, double wanted_n_per_m) const noexcept {
  return std::min(wanted_n_per_m, most_stiffness_n_per_m_ / enlargement(scene));
}

std::unique_ptr<HapticRun> Haptics::prepare(std::shared_ptr<const Scene> scene) {
  return std::make_unique<HapticRun>(std::move(scene));
}

std::unique_ptr<HapticRun> Haptics::adopt(std::unique_ptr<HapticRun> next) noexcept {
  if (next)
    next->stiffness_n_per_m = next->wanted_stiffness_n_per_m =
        stiffness_on_device(*next->scene, next->wanted_stiffness_n_per_m);
  if (run_ && next) next->take_over(*run_);
  std::swap(run_, next);
  empty_ = !run_ || run_->modes.empty();
  if (!run_) {
    placed_ = false;
    bridge_.exchange(last_wanted_, glm::dvec3(0.0));
    return next;
  }
  const Transform& device = run_->scene->world_from_device;
  if (placed_ && !(device == device_)) {
    // The device stands elsewhere in the new world: hand, proxy and force stay the same in device
    // space.
    proxy_ = device.world_from_volume(device_.volume_from_world(proxy_));
    last_probe_ = device.world_from_volume(device_.volume_from_world(last_probe_));
    last_wanted_ = device.rotation * (glm::conjugate(device_.rotation) * last_wanted_);
    hand_.reset();
    point_.reset();
    tank_.restart();
  }
  device_ = device;
  if (placed_) {
    // The force of the new scene with hand and proxy where they are now. The difference to the old
    // one is bridged; what the hand does next is felt at once.
    run_->place_proxy(proxy_);
    for (int i = 0; i < kFirstRounds; ++i) move_proxy(last_probe_, 0.0);
    bridge_.exchange(last_wanted_,
                     spring_n(last_probe_, point_.velocity_m_per_s(), hand_.velocity_m_per_s()));
  }
  return next;
}

void Haptics::control(const TickInput& input) noexcept {
  for (int e = 0; e < std::min(input.event_count, int(input.events.size())); ++e) {
    const ControlEvent& event = input.events[e];
    if (!std::isfinite(event.value)) continue;
    const bool of_volume = event.index >= 0 && event.index < int(run_->volumes.size());
    const bool of_mode = event.index >= 0 && event.index < int(run_->modes.size());
    switch (event.kind) {
      case ControlEvent::Kind::kRate:
        if (of_volume) run_->volumes[event.index].playback.set_rate(event.value);
        break;
      case ControlEvent::Kind::kScrub:
        if (of_volume) run_->volumes[event.index].playback.scrub_to(event.value);
        break;
      case ControlEvent::Kind::kModeOn:
        if (of_mode) run_->modes[event.index].on = event.value != 0.0;
        break;
      case ControlEvent::Kind::kModeGain:
        if (of_mode) run_->modes[event.index].wanted_gain = std::clamp(event.value, 0.0, 100.0);
        break;
      case ControlEvent::Kind::kStiffness:
        if (event.value > 0.0)
          run_->wanted_stiffness_n_per_m = stiffness_on_device(*run_->scene, event.value);
        break;
      case ControlEvent::Kind::kStop:
      case ControlEvent::Kind::kRearm:
        break;  // the guards' business
      case ControlEvent::Kind::kReleaseTube:
      case ControlEvent::Kind::kKeepTubes:
      case ControlEvent::Kind::kClearTubes:
        break;  // of those who look
    }
  }
  for (int p = 0; p < std::min(input.pose_count, int(input.poses.size())); ++p) {
    const PoseUpdate& update = input.poses[p];
    if (update.volume >= 0 && update.volume < int(run_->volumes.size()))
      run_->volumes[update.volume].pose.add(update.transform, update.time_ns);
  }
}

void Haptics::move_on(const TickInput& input, double dt_s) noexcept {
  run_->time_s += dt_s;
  for (const int v : run_->posed) {
    VolumeRun& volume = run_->volumes[v];
    const VolumeSpec& spec = volume.plan->spec;
    volume.set(volume.plan->pose == PoseStage::kDrive
                   ? driven(spec.drive, spec.transform, run_->time_s)
                   : volume.pose.at(input.now_ns));
  }
  for (const int v : run_->playing) {
    VolumeRun& volume = run_->volumes[v];
    volume.pointer = volume.playback.step(dt_s);
    volume.crossed = volume.playback.crossed();
    volume.blended = std::min(1.0, volume.blended + dt_s / kMotionBlend_s);
  }
  run_->ramp(dt_s, glm::length(last_wanted_));
  for (CarrierRun& carrier : run_->carriers) {
    carrier.frozen = false;
    carrier.carrier->clear_report();
    const glm::dvec3 before = carrier.carrier->at();
    carrier.carrier->carry();
    carrier.carried_m = carrier.carrier->at() - before;
    carrier.material_m = proxy_ + carrier.carried_m;
  }
}

/// Moves the proxy to its balance, as far as the energy tank allows.
Sweep Haptics::move_proxy(glm::dvec3 probe, double dt_s) noexcept {
  const double k = run_->stiffness_n_per_m;
  const Sweep swept = sweep(*run_, probe, k, dt_s);
  const glm::dvec3 wanted = is_finite(swept.proxy) ? swept.proxy : proxy_;
  proxy_ = options_.meter_energy ? tank_.limit(proxy_, wanted, probe, k, dt_s) : wanted;
  slipped_n_ = k * (wanted - proxy_);
  for (CarrierRun& carrier : run_->carriers)
    carrier.follow_to(proxy_, glm::length(last_wanted_), dt_s);
  return swept;
}

/// Equation (1). The damper acts between probe and proxy: in free space the proxy is at the probe
/// and there is nothing to damp.
glm::dvec3 Haptics::spring_n(glm::dvec3 probe, glm::dvec3 proxy_velocity,
                             glm::dvec3 probe_velocity) const noexcept {
  return run_->stiffness_n_per_m * (proxy_ - probe) +
         run_->scene->damping_n_s_per_m * (proxy_velocity - probe_velocity);
}

glm::dvec3 Haptics::force_n(glm::dvec3 probe, const TickInput& input, double dt_s) noexcept {
  glm::dvec3 of_proxy(0.0), of_probe(0.0);
  if (run_->scene->damping_n_s_per_m > 0.0) {
    of_proxy = point_.add(input.now_ns, proxy_);
    of_probe = hand_.add(input.reading.time_ns, probe);
  }
  ForceBridge::BridgeFrame frame;
  frame.spring_n = spring_n(probe, of_proxy, of_probe);
  frame.felt_n = last_wanted_;
  frame.step_m = probe - last_probe_;
  frame.stiffness_n_per_m = run_->stiffness_n_per_m;
  frame.dt_s = dt_s;
  // Viscous material yields to the force that was felt: how far, the last frame's drag says.
  const double yields_m =
      drag_n_s_per_m_ > 0.0 ? glm::length(last_wanted_) * dt_s / drag_n_s_per_m_ : 0.0;
  for (size_t c = 0; c < run_->carriers.size(); ++c) {
    const CarrierRun& run = run_->carriers[c];
    glm::dvec3 step_m = run.carried_m;
    if (yields_m > 0.0) step_m += shortened(proxy_ - run.material_m, yields_m);
    run_->material_steps[c] = {step_m, run.carrier->report().rough || run.frozen};
  }
  frame.materials = run_->material_steps;
  return frame.spring_n + bridge_.step(frame, options_.meter_energy ? &tank_ : nullptr);
}

/// Where the hand is for the scene, in device space. The guards take the position as it was read;
/// the scene takes where the hand will be when the force acts.
glm::dvec3 Haptics::read(const DeviceReading& reading, double dt_s) noexcept {
  if (reading.fault != DeviceFault::kNone) {
    lost_s_ += dt_s;
  } else if (lost_s_ > 0.0) {
    // Positions before and after a loss are not joined: the grip may have been put anywhere. After
    // a short loss the proxy stays where it was and waits for the hand; after a longer one it is
    // put at the hand.
    lead_.reset();
    device_hand_.reset();
    hand_.reset();
    point_.reset();
    if (lost_s_ > kShortLoss_s) placed_ = false;
    lost_s_ = 0.0;
  }
  if (reading.fresh) device_hand_.add(reading.time_ns, reading.position_m);
  return lead_.add(reading.time_ns, reading.position_m);
}

TickOutput Haptics::tick(const TickInput& input) noexcept {
  TickOutput out;
  SafetyInput guard;
  guard.dt_s = input.dt_s;
  guard.reading = input.reading;
  guard.late = input.late;
  guard.stop = input.stop;
  const double dt_s = std::isfinite(input.dt_s) ? std::clamp(input.dt_s, 0.0, kLongest_s) : 0.0;
  const glm::dvec3 led_m = read(input.reading, dt_s);
  guard.velocity_m_per_s = device_hand_.velocity_m_per_s();
  for (int e = 0; e < std::min(input.event_count, int(input.events.size())); ++e) {
    guard.stop |= input.events[e].kind == ControlEvent::Kind::kStop;
    guard.rearm |= input.events[e].kind == ControlEvent::Kind::kRearm;
  }

  // The guards report a position that is not finite; the scene goes on with the last finite one.
  glm::dvec3 probe = last_probe_;
  if (run_ && is_finite(led_m)) probe = run_->scene->world_from_device.world_from_volume(led_m);

  if (run_) {
    if (!placed_) {
      proxy_ = probe;
      run_->place_proxy(proxy_);
      tank_.restart();
      // Where nothing was read yet, the proxy goes on waiting for the hand.
      placed_ = input.reading.fault == DeviceFault::kNone && is_finite(input.reading.position_m);
    }
    control(input);
    move_on(input, dt_s);
    const Sweep swept = move_proxy(probe, dt_s);
    out.wanted_n = force_n(probe, input, dt_s);
    drag_n_s_per_m_ = swept.drag_n_s_per_m;
    out.substeps = uint8_t(std::min(swept.pieces, 255));
    out.primitives = uint8_t(swept.primitives);
    guard.touching = swept.touching;
    guard.stiffness_n_per_m = run_->stiffness_n_per_m * enlargement(*run_->scene);
    guard.scene = report(out);
    out.scene_energy_j = tank_.last_j();
    out.tank_j = tank_.energy_j();
    if (!run_->playing.empty()) out.first = run_->volumes[run_->playing.front()].pointer;
    guard.wanted_n = glm::conjugate(run_->scene->world_from_device.rotation) * out.wanted_n;
    last_wanted_ = is_finite(out.wanted_n) ? out.wanted_n : glm::dvec3(0.0);
  } else {
    out.wanted_n = last_wanted_ = bridge_.fade(dt_s);
    guard.wanted_n = glm::conjugate(device_.rotation) * out.wanted_n;
    guard.scene = Cause::kSceneEmpty;
  }
  last_probe_ = probe;
  out.probe_m = probe;
  out.proxy_m = run_ ? proxy_ : probe;

  const SafetyOutput safe = safety_.step(guard);
  out.command = {safe.force_n, safe.in_contact};
  out.hand_work_j = safe.work_j;
  out.ledger = safe.ledger;
  if (is_finite(guard.wanted_n)) account(out.ledger);
  out.cause = safe.cause;
  out.fault = input.reading.fault;
  return out;
}

/// Adds what tank and bridge changed before the guards.
void Haptics::account(ForceLedger& ledger) const noexcept {
  const glm::dquat device_from_world = glm::conjugate(device_.rotation);
  if (run_) ledger[Limiter::kTank] = device_from_world * slipped_n_;
  ledger[Limiter::kBridge] = -(device_from_world * bridge_.left_n());
  ledger.asked_n += ledger[Limiter::kTank] + ledger[Limiter::kBridge];
}

Cause Haptics::report(TickOutput& out) const noexcept {
  double confidence = 1.0;
  out.frozen = bridge_.is_rough();
  for (const CarrierRun& run : run_->carriers) {
    const CarrierReport& of = run.carrier->report();
    out.residual_m = std::max(out.residual_m, of.residual_m);
    out.newton_steps = std::max(out.newton_steps, uint8_t(std::min(of.steps, 255)));
    out.frozen |= run.frozen || of.not_finite;
    confidence = std::min(confidence, of.confidence);
  }
  if (empty_) return Cause::kSceneEmpty;
  if (out.frozen) return Cause::kField;
  if (confidence < kDoubtful) return Cause::kConfidence;
  return bridge_.is_felt() ? Cause::kSudden : Cause::kNone;
}

}  // namespace palpate
