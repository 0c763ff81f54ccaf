#include "integration/devices/falcon_judge.h"

#include <algorithm>
#include <cstdlib>

#include "integration/devices/falcon_kinematics.h"

namespace palpate::devices::falcon {
namespace {

// Where arms may lie against their stops, standing still is no fault.
constexpr double kInside = 0.9 * kWorkspaceRadius;

}  // namespace

DeviceReading FalconJudge::judge(const Exchange& exchange) noexcept {
  reading_.fresh = false;
  const DeviceFault found = examine(exchange);
  if (found != DeviceFault::kNone) {
    latch(found, found == DeviceFault::kNotHomed ? kSettle : kRecover);
  } else if (exchange.answer && needed_ > 0 && --needed_ == 0) {
    fault_ = DeviceFault::kNone;
  } else if (exchange.answer && fault_ == DeviceFault::kNotHomed) {
    fault_ = DeviceFault::kStarting;  // homed by now, and settling
  }
  if (exchange.answer) reading_.buttons = exchange.answer->buttons;
  if (exchange.answer && found == DeviceFault::kNone) {
    reading_.position_m = place_;
    reading_.time_ns = exchange.time_ns;
    reading_.fresh = true;
  }
  reading_.fault = fault_;
  return reading_;
}

DeviceReading FalconJudge::held(DeviceFault fault) const noexcept {
  DeviceReading reading = reading_;
  reading.fault = fault;
  reading.fresh = false;
  return reading;
}

void FalconJudge::restart() noexcept {
  const DeviceReading last = reading_;
  *this = FalconJudge();
  reading_ = last;
}

void FalconJudge::latch(DeviceFault fault, int good_answers) noexcept {
  fault_ = fault;
  needed_ = std::max(needed_, good_answers);
}

/// What is wrong with this exchange; kNone if it is good, or too early to say.
DeviceFault FalconJudge::examine(const Exchange& exchange) noexcept {
  if (!exchange.answer) {
    garbage_ |= exchange.garbage;
    if (++misses_ < kMisses) return DeviceFault::kNone;
    return garbage_ ? DeviceFault::kGarbage : DeviceFault::kTimeout;
  }
  misses_ = 0;
  garbage_ = false;
  homed_ = exchange.answer->homed == kAllHomed;
  if (!homed_) {  // counts from a zero that nobody knows
    placed_ = false;
    return DeviceFault::kNotHomed;
  }
  const bool had_place = placed_;
  const auto place = forward(arm_angles(exchange.answer->encoders), place_);
  if (!place) {
    placed_ = false;
    return DeviceFault::kOutOfReach;
  }
  const bool jump = had_place && jumped(place->metres, exchange.time_ns);
  place_ = place->metres;
  place_ns_ = exchange.time_ns;
  placed_ = true;
  if (jump) return DeviceFault::kJumped;
  return stuck(exchange) ? DeviceFault::kStuck : DeviceFault::kNone;
}

bool FalconJudge::jumped(glm::dvec3 position, int64_t time_ns) noexcept {
  const double elapsed_s = std::clamp(1e-9 * double(time_ns - place_ns_), 0.0, kJumpTime);
  return glm::distance(position, place_) > kJumpSlack + kHandSpeed * elapsed_s;
}

bool FalconJudge::stuck(const Exchange& exchange) noexcept {
  const auto& counts = exchange.answer->encoders;
  std::array<int, 3> moved;
  for (size_t e = 0; e < 3; ++e) moved[e] = std::abs(int(counts[e]) - int(counts_[e]));
  counts_ = counts;
  const bool inside = glm::distance(place_, kWorkspaceCentre) < kInside;

  // All three: a held grip still gives way by many counts to a newton.
  if (moved[0] || moved[1] || moved[2] || !inside) {
    still_ = 0;
    least_force_ = most_force_ = exchange.force_n;
  }
  least_force_ = glm::min(least_force_, exchange.force_n);
  most_force_ = glm::max(most_force_, exchange.force_n);
  // Counted from when the force has changed: the hand needs time to give way.
  if (glm::distance(least_force_, most_force_) >= kStillForce) ++still_;
  const bool all = still_ >= kStill;

  // One: nobody moves the grip far and leaves one arm where it is to the count.
  bool one = false;
  for (size_t e = 0; e < 3; ++e) {
    auto& path = path_[e];
    const size_t a = (e + 1) % 3, b = (e + 2) % 3;
    path[a] = std::min(path[a] + moved[a], 2 * kPassed);
    path[b] = std::min(path[b] + moved[b], 2 * kPassed);
    if (moved[e] || !inside) path[a] = path[b] = 0;
    one |= std::min(path[a], path[b]) >= kPassed;
  }
  return all || one;
}

}  // namespace palpate::devices::falcon
