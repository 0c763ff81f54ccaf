#include "module/haptics/proxy/velocity.h"

#include <algorithm>

#include "module/haptics/force_vector.h"

namespace palpate {
namespace {

// later - earlier, right also for clock readings at both ends of the range.
uint64_t elapsed(int64_t later, int64_t earlier) noexcept {
  return uint64_t(later) - uint64_t(earlier);
}

}  // namespace

VelocityEstimate::VelocityEstimate(double window_s) noexcept
    : window_ns_(uint64_t(1e9 * std::clamp(window_s > 0.0 ? window_s : 0.015, 1e-4, 10.0))) {}

void VelocityEstimate::reset() noexcept {
  count_ = 0;
  velocity_ = glm::dvec3(0.0);
}

const VelocityEstimate::TimedPosition& VelocityEstimate::back(int age) const noexcept {
  return ring_[size_t((newest_ + kCapacity - age) % kCapacity)];
}

glm::dvec3 VelocityEstimate::add(int64_t time_ns, glm::dvec3 position_m) noexcept {
  if (!is_finite(position_m)) return velocity_;
  if (count_ > 0 && time_ns <= back(0).time_ns) {
    if (elapsed(back(0).time_ns, time_ns) <= window_ns_) return velocity_;
    reset();
  }
  // The newest sample is replaced by this one while it is closer to the one before it than the ring
  // can resolve, so that the newest position always counts.
  const bool crowded =
      count_ > 1 && elapsed(back(0).time_ns, back(1).time_ns) < window_ns_ / (kCapacity - 1);
  if (!crowded) {
    newest_ = (newest_ + 1) % kCapacity;
    count_ = std::min(count_ + 1, kCapacity);
  }
  ring_[size_t(newest_)] = {time_ns, position_m};
  while (count_ > 2 && elapsed(time_ns, back(count_ - 1).time_ns) > window_ns_) --count_;
  velocity_ = slope();
  return velocity_;
}

glm::dvec3 VelocityEstimate::slope() const noexcept {
  if (count_ < 2) return glm::dvec3(0.0);
  // Relative to the newest sample: squares of absolute nanoseconds would lose the digits.
  const TimedPosition& origin = back(0);
  double mean_t = 0.0;
  glm::dvec3 mean_p(0.0);
  for (int i = 0; i < count_; ++i) {
    mean_t += -1e-9 * double(elapsed(origin.time_ns, back(i).time_ns));
    mean_p += back(i).position_m - origin.position_m;
  }
  mean_t /= count_;
  mean_p /= double(count_);
  double tt = 0.0;
  glm::dvec3 tp(0.0);
  for (int i = 0; i < count_; ++i) {
    const double t = -1e-9 * double(elapsed(origin.time_ns, back(i).time_ns)) - mean_t;
    tt += t * t;
    tp += t * (back(i).position_m - origin.position_m - mean_p);
  }
  const glm::dvec3 v = tp / tt;  // times differ, so tt > 0
  return is_finite(v) ? v : glm::dvec3(0.0);
}

}  // namespace palpate
