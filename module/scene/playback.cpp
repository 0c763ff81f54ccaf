#include "module/scene/playback.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {
namespace {

constexpr double kRampS = 0.020;      // of a change of rate
constexpr double kSettleS = 0.010;    // time constant of the last part of an approach
constexpr double kArrivedS = 1e-6;    // nearer counts as arrived; the velocity then is 1e-4 s per s
constexpr double kOnTheEndS = 1e-12;  // rounding of a time that should be an end exactly

/// The largest speed that still comes to rest within `way`: braking at a constant full_speed / 20
/// ms, at the end like exp(-t / 10 ms), which does not brake harder.
double arriving_speed(double way, double full_speed) {
  const double braking = full_speed / kRampS;
  const double speed =
      way < braking * kSettleS * kSettleS ? way / kSettleS : std::sqrt(braking * way);
  return std::min(full_speed, speed);
}

/// a + b as two doubles, without error.
struct DoubleDouble {
  double high, low;
};
DoubleDouble exact_sum(double a, double b) {
  const double high = a + b, back = high - a;
  return {high, (a - (high - back)) + (b - back)};
}
DoubleDouble exact_sum(DoubleDouble a, double b) {
  const DoubleDouble s = exact_sum(a.high, b);
  return exact_sum(s.high, s.low + a.low);
}

}  // namespace

bool Playback::is_single() const {
  return !times_ || times_->times_s.size() < 2;
}

double Playback::start_of(int frame) const {
  return times_->times_s[size_t(frame)];
}

double Playback::end_of(int frame) const {
  if (frame + 1 < int(times_->times_s.size())) return times_->times_s[size_t(frame) + 1];
  return times_->cyclic() ? times_->cycle_s : std::numeric_limits<double>::infinity();
}

void Playback::set_times(const FrameTimes* times) noexcept {
  times_ = times;
  crossed_ = 0;
  if (is_single()) {
    pointer_ = {};
    time_s_ = time_low_s_ = owed_s_ = 0.0;
    return;
  }
  const double length = times_->length_s();
  const double beyond = (time_s_ - length) + time_low_s_;
  if (times_->cyclic() ? beyond >= 0.0 : beyond > 0.0) {
    time_s_ = times_->cyclic() ? std::fmod(time_s_, length) : length;
    time_low_s_ = 0.0;
  }
  const auto& t = times_->times_s;
  pointer_.frame = std::max(0, int(std::upper_bound(t.begin(), t.end(), time_s_) - t.begin()) - 1);
  // A time just below a border rounds to it; the low part tells the side.
  if (time_s_ == start_of(pointer_.frame) && time_low_s_ < 0.0 && pointer_.frame > 0)
    --pointer_.frame;
  start_ramp();
  set_phase();
}

void Playback::set_rate(double rate) noexcept {
  if (!std::isfinite(rate)) return;
  wanted_rate_ = rate;
  if (rate == 0.0) owed_s_ = 0.0;
  start_ramp();
}

void Playback::scrub_to(double time_s, double max_speed) noexcept {
  if (is_single() || !std::isfinite(time_s) || !(max_speed > 0.0) || std::isinf(max_speed)) return;
  const double length = times_->length_s();
  scrub_target_s_ = times_->cyclic() ? std::fmod(time_s, length) : std::clamp(time_s, 0.0, length);
  scrub_speed_ = max_speed;
  scrubbing_ = true;
}

bool Playback::at_rest() const {
  if (is_single()) return true;
  if (scrubbing_ || owed_s_ != 0.0 || rate_ != 0.0) return false;
  if (wanted_rate_ == 0.0) return true;
  return !times_->cyclic() && time_s_ == (wanted_rate_ > 0.0 ? times_->length_s() : 0.0);
}

FramePointer Playback::step(double dt_s) noexcept {
  crossed_ = 0;
  if (is_single() || !(dt_s > 0.0) || std::isinf(dt_s)) return pointer_;
  owed_s_ += advance_rate(dt_s);
  // Whole cycles can be left out.
  if (times_->cyclic() && std::abs(owed_s_) >= times_->cycle_s)
    owed_s_ = std::fmod(owed_s_, times_->cycle_s);
  if (owed_s_ != 0.0) move(owed_s_);
  return pointer_;
}

void Playback::start_ramp() {
  ramp_per_s_ = std::abs(wanted_rate_ - rate_) / kRampS;
}

/// Way left to the scrub's target, signed; way that is owed counts as done.
double Playback::to_target() const {
  const double way = (scrub_target_s_ - time_s_) - time_low_s_ - owed_s_;
  return times_->cyclic() ? std::remainder(way, times_->cycle_s) : way;
}

/// Way that is left to the end it moves to, >= 0.
double Playback::to_end(double direction) const {
  const double gone = time_low_s_ + owed_s_;
  return std::max(0.0, direction > 0.0 ? (times_->length_s() - time_s_) - gone : time_s_ + gone);
}

/// The velocity's next value, and the way gone with it in dt: the integral of the ramp, exactly.
double Playback::advance_rate(double dt_s) {
  double wanted = wanted_rate_, change_per_s = ramp_per_s_;
  double limit = std::numeric_limits<double>::infinity();  // of the way, against overshoot
  double to_target_s = limit;
  bool arrives = false;
  if (scrubbing_) {
    const double way = to_target();
    const double speed = std::max(scrub_speed_, std::abs(rate_));
    wanted = std::copysign(std::min(scrub_speed_, arriving_speed(std::abs(way), speed)), way);
    change_per_s = speed / kRampS;
    if (rate_ * way >= 0.0) limit = to_target_s = std::abs(way);
    arrives = limit < kArrivedS;
  }
  if (!times_->cyclic()) {
    const double direction = rate_ != 0.0 ? rate_ : wanted;
    const double way = to_end(direction);
    const double speed = std::max(std::abs(wanted), std::abs(rate_));
    const double highest = arriving_speed(way, speed);
    if (std::abs(rate_) > highest || (wanted * direction > 0.0 && std::abs(wanted) > highest)) {
      if (wanted * direction > 0.0)
        wanted = std::copysign(std::min(std::abs(wanted), highest), wanted);
      change_per_s = std::max(change_per_s, speed / kRampS);
    }
    limit = std::min(limit, way);
  }
  const double before = rate_, change = wanted - before;
  const double ramp_s = change_per_s > 0.0 ? std::min(dt_s, std::abs(change) / change_per_s) : 0.0;
  rate_ = ramp_s < dt_s ? wanted : before + std::copysign(change_per_s * dt_s, change);
  double way = 0.5 * (before + rate_) * ramp_s + rate_ * (dt_s - ramp_s);
  if (way != 0.0 && (limit < kArrivedS || std::abs(way) > limit)) {
    way = std::copysign(limit, way);
    // A late step that would pass the target ends on it: with a velocity left, the next would go
    // past, since rounding decides on which side of the target this one ended.
    arrives |= scrubbing_ && limit == to_target_s;
  }
  if (arrives) {
    scrubbing_ = false;
    rate_ = 0.0;
    start_ramp();
  }
  return way;
}

/// Moves by `way`, over one border at most; what is left is owed.
void Playback::move(double way) {
  DoubleDouble to = exact_sum({time_s_, time_low_s_}, way);
  const auto past = [&](double border) { return (to.high - border) + to.low; };
  const int last = int(times_->times_s.size()) - 1;
  int& frame = pointer_.frame;
  owed_s_ = 0.0;
  if (!times_->cyclic()) {
    if (way > 0.0 && past(times_->length_s()) > -kOnTheEndS) to = {times_->length_s(), 0.0};
    if (way < 0.0 && past(0.0) < kOnTheEndS) to = {0.0, 0.0};
  }
  if (way > 0.0 && past(end_of(frame)) >= 0.0) {
    crossed_ = 1;
    if (frame == last) to = exact_sum(to, -times_->cycle_s);
    frame = frame == last ? 0 : frame + 1;
    if (const double beyond = past(end_of(frame)); beyond >= 0.0) {
      to = {std::nextafter(end_of(frame), 0.0), 0.0};
      owed_s_ = beyond + (end_of(frame) - to.high);
    }
  } else if (way < 0.0 && past(start_of(frame)) < 0.0) {
    crossed_ = -1;
    if (frame == 0) to = exact_sum(to, times_->cycle_s);
    frame = frame == 0 ? last : frame - 1;
    if (const double beyond = past(start_of(frame)); beyond < 0.0) {
      to = {start_of(frame), 0.0};
      owed_s_ = beyond;
    }
  }
  time_s_ = to.high;
  time_low_s_ = to.low;
  set_phase();
}

void Playback::set_phase() {
  const double start = start_of(pointer_.frame), length = end_of(pointer_.frame) - start;
  const double phase = ((time_s_ - start) + time_low_s_) / length;
  pointer_.phase = std::clamp(phase, 0.0, 1.0 - 0x1p-53);
}

FramePointer pointer_at(const FrameTimes& times, double time_s) noexcept {
  const double length = times.length_s();
  if (times.times_s.size() < 2 || !(length > 0.0) || !std::isfinite(time_s)) return {};
  double at = std::clamp(time_s, 0.0, length);
  if (times.cyclic()) {
    at = std::fmod(time_s, length);
    if (at < 0.0) at += length;
  } else if (at >= length) {
    return {int(times.times_s.size()) - 1, 0.0};
  }
  const auto after = std::upper_bound(times.times_s.begin(), times.times_s.end(), at);
  const int frame = std::max(0, int(after - times.times_s.begin()) - 1);
  const double from = times.times_s[size_t(frame)];
  const double to = after == times.times_s.end() ? length : *after;
  return {frame, std::clamp((at - from) / (to - from), 0.0, std::nextafter(1.0, 0.0))};
}

}  // namespace palpate
