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

constexpr double kSaid_n = 0.05;  // a bridge with less left is not reported

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
      gives_torque_(device.max_torque_n_m > 0.0),
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
    for (Tip& tip : tips()) tip.bridge.exchange(tip.felt_n, glm::dvec3(0.0));
    return next;
  }
  const Transform& device = run_->scene->world_from_device;
  if (placed_ && !(device == device_)) {
    // The device stands elsewhere in the new world: hand, proxy and force stay the same in device
    // space.
    for (Tip& tip : tips()) {
      tip.proxy_m = device.world_from_volume(device_.volume_from_world(tip.proxy_m));
      tip.felt_n = device.rotation * (glm::conjugate(device_.rotation) * tip.felt_n);
    }
    probe_ = device.world_from_volume(device_.volume_from_world(probe_));
    last_wanted_ = device.rotation * (glm::conjugate(device_.rotation) * last_wanted_);
    hand_.reset();
    point_.reset();
    tank_.restart();
  }
  device_ = device;
  if (run_->points.size() != tip_count_) change_tool();
  move_probes();
  if (placed_) {
    // The force of the new scene with hand and proxy where they are now. The difference to the old
    // one is bridged; what the hand does next is felt at once.
    for (size_t i = 0; i < tip_count_; ++i) run_->points[i].place_proxy(tips_[i].proxy_m);
    for (int i = 0; i < kFirstRounds; ++i) move_proxies(0.0);
    const glm::dvec3 damping_n =
        run_->scene->damping_n_s_per_m * (point_.velocity_m_per_s() - hand_.velocity_m_per_s());
    for (Tip& tip : tips())
      tip.bridge.exchange(tip.felt_n,
                          run_->stiffness_n_per_m * (tip.proxy_m - tip.probe_m) + damping_n);
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
  for (size_t i = 0; i < tip_count_; ++i)
    for (CarrierRun& carrier : run_->points[i].carriers) {
      carrier.frozen = false;
      carrier.carrier->clear_report();
      const glm::dvec3 before = carrier.carrier->at();
      carrier.carrier->carry();
      carrier.carried_m = carrier.carrier->at() - before;
      carrier.material_m = tips_[i].proxy_m + carrier.carried_m;
    }
}

/// Another number of points: each begins with the tool's force and depth.
void Haptics::change_tool() noexcept {
  Tip tip;
  tip.proxy_m = mean([](const Tip& of) { return of.proxy_m; });
  tip.felt_n = last_wanted_;
  tip_count_ = run_->points.size();
  for (size_t i = 0; i < tip_count_; ++i) {
    tip.lever_m = device_.rotation * (device_from_grip_ * run_->scene->points_m[i]);
    tip.probe_m = probe_ + tip.lever_m;
    tips_[i] = tip;
    tips_[i].proxy_m += tip.lever_m;
  }
  tank_.restart();
}

/// Takes the probes of all points to where the device is and how its grip is held.
void Haptics::move_probes() noexcept {
  const Scene& scene = *run_->scene;
  for (size_t i = 0; i < tip_count_; ++i) {
    Tip& tip = tips_[i];
    const glm::dvec3 lever_m =
        scene.world_from_device.rotation * (device_from_grip_ * scene.points_m[i]);
    tip.step_m = probe_ + lever_m - tip.probe_m;
    tip.turned_m = gives_torque_ ? glm::dvec3(0.0) : lever_m - tip.lever_m;
    tip.lever_m = lever_m;
    tip.probe_m = probe_ + lever_m;
  }
}

/// Puts the proxies to their probes.
void Haptics::place_proxies() noexcept {
  for (size_t i = 0; i < tip_count_; ++i) {
    tips_[i].proxy_m = tips_[i].probe_m;
    run_->points[i].place_proxy(tips_[i].proxy_m);
  }
  tank_.restart();
}

/// Moves the proxies to their balance, as far as the energy tank allows.
Sweep Haptics::move_proxies(double dt_s) noexcept {
  const double k = run_->stiffness_n_per_m;
  std::array<SpringMove, kMostToolPoints> springs;
  Sweep all;
  for (size_t i = 0; i < tip_count_; ++i) {
    Tip& tip = tips_[i];
    const Sweep swept = sweep(*run_, run_->points[i], tip.probe_m, k, dt_s);
    springs[i] = {tip.proxy_m, is_finite(swept.proxy) ? swept.proxy : tip.proxy_m, tip.probe_m,
                  tip.turned_m};
    tip.slipped_n = springs[i].to;
    run_->points[i].drag_n_s_per_m = swept.drag_n_s_per_m;
    all.pieces = std::max(all.pieces, swept.pieces);
    all.primitives += swept.primitives;
    all.touching |= swept.touching;
  }
  if (options_.meter_energy)
    tank_.limit({springs.data(), tip_count_}, k / double(tip_count_), dt_s);
  for (size_t i = 0; i < tip_count_; ++i) {
    Tip& tip = tips_[i];
    tip.proxy_m = springs[i].to;
    tip.slipped_n = k * (tip.slipped_n - tip.proxy_m);
    for (CarrierRun& carrier : run_->points[i].carriers)
      carrier.follow_to(tip.proxy_m, glm::length(tip.felt_n), dt_s);
  }
  return all;
}

/// Equation (1) for each point, and its bridge; the mean is the force on the hand. The damper acts
/// between the tool's probe and proxy: in free space the proxy is at the probe and there is nothing
/// to damp.
glm::dvec3 Haptics::force_n(const TickInput& input, double dt_s) noexcept {
  const double damping_n_s_per_m = run_->scene->damping_n_s_per_m;
  glm::dvec3 damping_n(0.0);
  if (damping_n_s_per_m > 0.0) {
    const glm::dvec3 of_proxy =
        point_.add(input.now_ns, mean([](const Tip& of) { return of.proxy_m; }));
    damping_n = damping_n_s_per_m * (of_proxy - hand_.add(input.reading.time_ns, probe_));
  }
  for (size_t i = 0; i < tip_count_; ++i) {
    Tip& tip = tips_[i];
    PointRun& point = run_->points[i];
    ForceBridge::BridgeFrame frame;
    frame.spring_n = run_->stiffness_n_per_m * (tip.proxy_m - tip.probe_m) + damping_n;
    frame.felt_n = tip.felt_n;
    frame.step_m = tip.step_m;
    frame.worked_m = tip.step_m - tip.turned_m;
    frame.stiffness_n_per_m = run_->stiffness_n_per_m;
    frame.dt_s = dt_s;
    frame.share = 1.0 / double(tip_count_);
    // Viscous material yields to the force that was felt: how far, the last frame's drag says.
    const double yields_m =
        tip.drag_n_s_per_m > 0.0 ? glm::length(tip.felt_n) * dt_s / tip.drag_n_s_per_m : 0.0;
    tip.drag_n_s_per_m = point.drag_n_s_per_m;
    for (size_t c = 0; c < point.carriers.size(); ++c) {
      const CarrierRun& run = point.carriers[c];
      glm::dvec3 step_m = run.carried_m;
      if (yields_m > 0.0) step_m += shortened(tip.proxy_m - run.material_m, yields_m);
      point.material_steps[c] = {step_m, run.carrier->report().rough || run.frozen};
    }
    frame.materials = point.material_steps;
    tip.felt_n = frame.spring_n + tip.bridge.step(frame, options_.meter_energy ? &tank_ : nullptr);
  }
  return mean([](const Tip& of) { return of.felt_n; });
}

/// The moment of the points' forces about the device's position, and how far they are from it; both
/// in device space.
void Haptics::add_torque(SafetyInput& guard) const noexcept {
  const glm::dquat device_from_world = glm::conjugate(device_.rotation);
  guard.wanted_torque_n_m = mean([&](const Tip& of) {
    return glm::cross(device_from_world * of.lever_m / device_.scale,
                      device_from_world * of.felt_n);
  });
  for (const Tip& tip : tips())
    guard.lever_m =
        std::max(guard.lever_m, glm::length(device_from_world * tip.lever_m / device_.scale));
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
  // An orientation that is not sensed at the moment stays as it was.
  if (reading.fault == DeviceFault::kNone && reading.grip.turns)
    device_from_grip_ = reading.grip.device_from_grip;
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

  if (run_) {
    // The guards report a position that is not finite; the scene goes on with the last finite one.
    if (is_finite(led_m)) probe_ = run_->scene->world_from_device.world_from_volume(led_m);
    move_probes();
    if (!placed_) {
      place_proxies();
      // Where nothing was read yet, the proxies go on waiting for the hand.
      placed_ = input.reading.fault == DeviceFault::kNone && is_finite(input.reading.position_m);
    }
    control(input);
    move_on(input, dt_s);
    const Sweep swept = move_proxies(dt_s);
    out.wanted_n = force_n(input, dt_s);
    out.substeps = uint8_t(std::min(swept.pieces, 255));
    out.primitives = uint8_t(swept.primitives);
    guard.touching = swept.touching;
    guard.stiffness_n_per_m = run_->stiffness_n_per_m * enlargement(*run_->scene);
    guard.scene = report(out);
    out.scene_energy_j = tank_.last_j();
    out.tank_j = tank_.energy_j();
    if (!run_->playing.empty()) out.first = run_->volumes[run_->playing.front()].pointer;
    add_torque(guard);
    if (!is_finite(out.wanted_n))
      for (Tip& tip : tips()) tip.felt_n = glm::dvec3(0.0);
  } else {
    for (Tip& tip : tips()) tip.felt_n = tip.bridge.fade(dt_s);
    out.wanted_n = mean([](const Tip& of) { return of.felt_n; });
    add_torque(guard);
    guard.scene = Cause::kSceneEmpty;
  }
  guard.wanted_n = glm::conjugate(device_.rotation) * out.wanted_n;
  last_wanted_ = is_finite(out.wanted_n) ? out.wanted_n : glm::dvec3(0.0);
  out.probe_m = probe_;
  out.proxy_m = run_ ? mean([](const Tip& of) { return of.proxy_m; }) : probe_;

  const SafetyOutput safe = safety_.step(guard);
  out.command = {safe.force_n, safe.in_contact, safe.torque_n_m};
  out.hand_work_j = safe.work_j;
  out.ledger = safe.ledger;
  if (is_finite(guard.wanted_n)) account(out.ledger);
  out.cause = safe.cause;
  out.fault = input.reading.fault;
  return out;
}

PointsSnapshot Haptics::points() const noexcept {
  PointsSnapshot points;
  if (!run_ || tip_count_ < 2) return points;
  points.count = int(tip_count_);
  for (size_t i = 0; i < tip_count_; ++i) points.proxies_m[i] = tips_[i].proxy_m;
  return points;
}

/// What the bridges add to the force.
glm::dvec3 Haptics::bridged_n() const noexcept {
  return mean([](const Tip& of) { return of.bridge.left_n(); });
}

/// Adds what tank and bridge changed before the guards.
void Haptics::account(ForceLedger& ledger) const noexcept {
  const glm::dquat device_from_world = glm::conjugate(device_.rotation);
  if (run_)
    ledger[Limiter::kTank] = device_from_world * mean([](const Tip& of) { return of.slipped_n; });
  ledger[Limiter::kBridge] = -(device_from_world * bridged_n());
  ledger.asked_n += ledger[Limiter::kTank] + ledger[Limiter::kBridge];
}

Cause Haptics::report(TickOutput& out) const noexcept {
  double confidence = 1.0;
  bool sudden = false;
  for (const Tip& tip : tips()) {
    out.frozen |= tip.bridge.is_rough();
    sudden |= tip.bridge.is_sudden();
  }
  for (const PointRun& point : run_->points)
    for (const CarrierRun& run : point.carriers) {
      const CarrierReport& of = run.carrier->report();
      out.residual_m = std::max(out.residual_m, of.residual_m);
      out.newton_steps = std::max(out.newton_steps, uint8_t(std::min(of.steps, 255)));
      out.frozen |= run.frozen || of.not_finite;
      confidence = std::min(confidence, of.confidence);
    }
  if (empty_) return Cause::kSceneEmpty;
  if (out.frozen) return Cause::kField;
  if (confidence < kDoubtful) return Cause::kConfidence;
  return sudden && glm::length(bridged_n()) > kSaid_n ? Cause::kSudden : Cause::kNone;
}

}  // namespace palpate
