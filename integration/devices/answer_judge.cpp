#include "integration/devices/answer_judge.h"

#include <algorithm>

#include "module/haptics/force_vector.h"

namespace palpate::devices {

DeviceReading AnswerJudge::judge(const Exchange& exchange) noexcept {
  reading_.fresh = false;
  const DeviceFault found = examine(exchange);
  if (found != DeviceFault::kNone) {
    latch(found, found == DeviceFault::kNotHomed ? kSettle : kRecover);
  } else if (exchange.answered && needed_ > 0 && --needed_ == 0) {
    fault_ = DeviceFault::kNone;
  } else if (exchange.answered && fault_ == DeviceFault::kNotHomed) {
    fault_ = DeviceFault::kStarting;  // homed by now, and settling
  }
  if (exchange.answered) {
    reading_.buttons = exchange.buttons;
    reading_.grip = believable(exchange.grip);
  }
  if (exchange.answered && found == DeviceFault::kNone) {
    reading_.position_m = place_;
    reading_.time_ns = exchange.time_ns;
    reading_.fresh = true;
  }
  reading_.fault = fault_;
  return reading_;
}

DeviceReading AnswerJudge::frozen(DeviceFault fault) const noexcept {
  DeviceReading reading = reading_;
  reading.fault = fault;
  reading.fresh = false;
  return reading;
}

void AnswerJudge::restart() noexcept {
  const DeviceReading last = reading_;
  *this = AnswerJudge(centre_m_, inside_m_ / kInside);
  reading_ = last;
}

void AnswerJudge::latch(DeviceFault fault, int good_answers) noexcept {
  fault_ = fault;
  needed_ = std::max(needed_, good_answers);
}

/// The fault of this exchange; kNone if it is good, or if it is too early to decide.
DeviceFault AnswerJudge::examine(const Exchange& exchange) noexcept {
  if (!exchange.answered) {
    garbage_ |= exchange.garbage;
    if (++misses_ < kMisses) return DeviceFault::kNone;
    return garbage_ ? DeviceFault::kGarbage : DeviceFault::kTimeout;
  }
  misses_ = 0;
  garbage_ = false;
  if (exchange.said != DeviceFault::kNone || !is_finite(exchange.position_m)) {
    placed_ = false;
    return exchange.said != DeviceFault::kNone ? exchange.said : DeviceFault::kGarbage;
  }
  const bool jump = placed_ && jumped(exchange.position_m, exchange.time_ns);
  place_ = exchange.position_m;
  place_ns_ = exchange.time_ns;
  placed_ = true;
  if (jump) return DeviceFault::kJumped;
  return stuck(exchange) || exchange.one_stands ? DeviceFault::kStuck : DeviceFault::kNone;
}

bool AnswerJudge::jumped(glm::dvec3 position, int64_t time_ns) const noexcept {
  const double elapsed_s = std::clamp(1e-9 * double(time_ns - place_ns_), 0.0, kJumpTime);
  return glm::distance(position, place_) > kJumpSlack + kHandSpeed * elapsed_s;
}

/// A grip that is held still gives way to a newton by more than a sensor resolves.
bool AnswerJudge::stuck(const Exchange& exchange) noexcept {
  if (exchange.moved || !is_inside(place_)) {
    still_ = 0;
    least_force_ = most_force_ = exchange.force_n;
  }
  least_force_ = glm::min(least_force_, exchange.force_n);
  most_force_ = glm::max(most_force_, exchange.force_n);
  // Counted from when the force has changed: the hand needs time to give way.
  if (glm::distance(least_force_, most_force_) >= kStillForce) ++still_;
  return still_ >= kStill;
}

}  // namespace palpate::devices
