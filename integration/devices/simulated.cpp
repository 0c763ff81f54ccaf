#include "integration/devices/simulated.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "module/haptics/servo/monotonic.h"

namespace palpate::devices {
namespace {

/// Forces on their way: 50 ms of delay at 20 kHz.
constexpr size_t kComing = 1024;
/// A program that was stopped for longer does not make up for all of it at once.
constexpr int64_t kLongestCatchUp_ns = 500'000'000;

int64_t ns(double seconds) {
  return int64_t(std::llround(seconds * 1e9));
}

}  // namespace

DeviceInfo info_of(const SimulatedOptions& options) {
  DeviceInfo info;
  info.kind = "simulated";
  info.name = "simulated device";
  info.max_force_n = options.max_force_n;
  // b / (T/2 + delay) at 1 kHz, of the device without the hand's help.
  const double delay_s = options.read_delay_s + options.force_delay_s;
  info.max_stiffness_n_per_m = options.body.damping_n_s_per_m / (0.5e-3 + delay_s);
  info.workspace_centre_m = options.workspace_centre_m;
  info.workspace_radius_m = options.workspace_radius_m;
  info.resolution_m = options.resolution_m;
  info.delay_s = delay_s;
  info.buttons = options.buttons;
  return info;
}

SimulatedDevice::SimulatedDevice(SimulatedOptions options)
    : options_(std::move(options)),
      body_(options_.body, options_.path.position_m(0.0)),
      random_(options_.seed),
      coming_(kComing),
      sub_step_ns_(ns(options_.sub_step_s)),
      lets_go_ns_(std::numeric_limits<int64_t>::max()) {
  assert(sub_step_ns_ > 0);
  assert(options_.resolution_m >= 0.0 && options_.max_force_n >= 0.0);
  assert(options_.force_delay_s >= 0.0 && options_.force_delay_s <= 0.05);
  assert(options_.read_delay_s >= 0.0 && options_.jitter_s >= 0.0);
  // Forces cut steps as well: as many as sub-steps, at the most.
  const double age_s = options_.read_delay_s + options_.jitter_s;
  past_.resize(2 * size_t(std::ceil(age_s / options_.sub_step_s)) + 8);
  if (options_.real_time) start_ns_ = clock_ns();
  now_ns_ = last_force_ns_ = start_ns_;
  if (std::isfinite(options_.lets_go_at_s)) lets_go_ns_ = start_ns_ + ns(options_.lets_go_at_s);
  last_.position_m = body_.position_m();
  last_.time_ns = start_ns_;
  remember();
}

DeviceReading SimulatedDevice::exchange(const DeviceCommand& command) noexcept {
  return exchange_at(command, options_.real_time ? clock_ns() : now_ns_);
}

void SimulatedDevice::step(double dt_s) noexcept {
  assert(!options_.real_time);
  if (dt_s > 0.0) advance_to(now_ns_ + ns(dt_s));
}

DeviceReading SimulatedDevice::exchange_at(const DeviceCommand& command, int64_t now_ns) noexcept {
  advance_to(now_ns);
  const double jitter_s = options_.jitter_s > 0.0 ? options_.jitter_s * draw() : 0.0;
  last_.fresh = !(options_.lost_share > 0.0 && draw() < options_.lost_share);
  if (!last_.fresh) return last_;
  if (coming_count_ < coming_.size()) {
    coming_[(coming_begin_ + coming_count_++) % coming_.size()] = {
        now_ns_ + ns(options_.force_delay_s), clamped(command.force_n)};
  }
  take_due_forces();
  const int64_t delay_ns = ns(options_.read_delay_s);
  glm::dvec3 position = position_at(now_ns_ - delay_ns - ns(jitter_s));
  if (options_.resolution_m > 0.0)
    position = glm::round(position / options_.resolution_m) * options_.resolution_m;
  last_.position_m = position;
  last_.time_ns = now_ns_ - delay_ns;
  last_.buttons = options_.path.buttons(time_s());
  last_.grip = options_.grip;
  return last_;
}

void SimulatedDevice::advance_to(int64_t time_ns) noexcept {
  if (time_ns - now_ns_ > kLongestCatchUp_ns) {
    const int64_t skipped = time_ns - kLongestCatchUp_ns - now_ns_;
    now_ns_ += skipped;
    // The forces that were on their way are over; the last of them holds.
    take_due_forces();
  }
  while (now_ns_ < time_ns) {
    int64_t next = std::min(time_ns, now_ns_ + sub_step_ns_);
    const double slewing_n = glm::length(wanted_n() - motor_n_);
    if (options_.max_slew_n_per_s > 0.0 && slewing_n > 0.0)
      next = std::min(next, now_ns_ + 1 + int64_t(slewing_n / options_.max_slew_n_per_s * 1e9));
    if (coming_count_ > 0) next = std::min(next, coming_[coming_begin_].time_ns);
    if (gripped_ && lets_go_ns_ > now_ns_) next = std::min(next, lets_go_ns_);
    move(next);
    take_due_forces();
    if (gripped_ && now_ns_ >= lets_go_ns_) {
      gripped_ = false;
      body_.set_hand(kNoHand);
    }
  }
}

void SimulatedDevice::move(int64_t until_ns) noexcept {
  const double from_s = time_s();
  const double dt_s = double(until_ns - now_ns_) * 1e-9;
  const glm::dvec3 change = wanted_n() - motor_n_;
  const double size = glm::length(change), most = options_.max_slew_n_per_s * dt_s;
  const bool slews = options_.max_slew_n_per_s > 0.0;
  const glm::dvec3 before_n = motor_n_;
  motor_n_ += slews && size > most ? change * (most / size) : change;
  // A force on its way to its target is a ramp, whose end is the end of a step: its mean acts.
  const glm::dvec3 acting_n = slews ? 0.5 * (before_n + motor_n_) : motor_n_;
  const glm::dvec3 was_m = body_.position_m();
  now_ns_ = until_ns;
  body_.advance(dt_s, acting_n, options_.path.position_m(from_s),
                options_.path.position_m(time_s()));
  motor_work_j_ += glm::dot(acting_n, body_.position_m() - was_m);
  const glm::dvec3 away = body_.position_m() - options_.workspace_centre_m;
  const double distance = glm::length(away);
  if (distance > options_.workspace_radius_m) {
    const glm::dvec3 out = away / distance, velocity = body_.velocity_m_per_s();
    body_.put(options_.workspace_centre_m + out * options_.workspace_radius_m,
              velocity - out * std::max(0.0, glm::dot(velocity, out)));
  }
  remember();
}

glm::dvec3 SimulatedDevice::wanted_n() const noexcept {
  return now_ns_ - last_force_ns_ >= ns(options_.silence_s) ? glm::dvec3(0.0) : target_n_;
}

void SimulatedDevice::take_due_forces() noexcept {
  while (coming_count_ > 0 && coming_[coming_begin_].time_ns <= now_ns_) {
    target_n_ = coming_[coming_begin_].force_n;
    last_force_ns_ = coming_[coming_begin_].time_ns;
    coming_begin_ = (coming_begin_ + 1) % coming_.size();
    --coming_count_;
  }
}

void SimulatedDevice::remember() noexcept {
  past_[past_end_] = {now_ns_, body_.position_m(), body_.velocity_m_per_s()};
  past_end_ = (past_end_ + 1) % past_.size();
  past_count_ = std::min(past_count_ + 1, past_.size());
}

glm::dvec3 SimulatedDevice::position_at(int64_t time_ns) const noexcept {
  const auto back = [&](size_t n) -> const Past& {
    return past_[(past_end_ + past_.size() - 1 - n) % past_.size()];
  };
  if (time_ns >= back(0).time_ns) return back(0).position_m;
  for (size_t n = 1; n < past_count_; ++n) {
    const Past &a = back(n), &b = back(n - 1);
    if (a.time_ns > time_ns) continue;
    // Cubic Hermite: exact for an even force, and the force is even within a step.
    const double dt = double(b.time_ns - a.time_ns) * 1e-9;
    const double u = double(time_ns - a.time_ns) * 1e-9 / dt, w = 1.0 - u;
    return a.position_m * (w * w * (1.0 + 2.0 * u)) + b.position_m * (u * u * (3.0 - 2.0 * u)) +
           a.velocity_m_per_s * (dt * u * w * w) - b.velocity_m_per_s * (dt * u * u * w);
  }
  return back(past_count_ - 1).position_m;
}

glm::dvec3 SimulatedDevice::clamped(glm::dvec3 force_n) const noexcept {
  const double size = glm::length(force_n);
  if (!std::isfinite(size)) return glm::dvec3(0.0);  // as a driver must: never a NaN to a motor
  return size > options_.max_force_n ? force_n * (options_.max_force_n / size) : force_n;
}

int64_t SimulatedDevice::clock_ns() const noexcept {
  return options_.clock ? options_.clock->now_ns() : monotonic_ns();
}

double SimulatedDevice::draw() noexcept {
  return double(random_()) * 0x1p-32;
}

}  // namespace palpate::devices
