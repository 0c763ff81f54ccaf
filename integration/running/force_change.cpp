#include "integration/running/force_change.h"

#include <algorithm>

namespace palpate::running {

void ForceChange::add(double dt_s, const glm::dvec3& force_n) {
  const TimedForce before = at(0);
  const double passed_s = dt_s > 0.0 ? dt_s : 0.0;
  if (count_ > 0 && passed_s > late_s_) {
    ++late_ticks_;
    latest_s_ = std::max(latest_s_, passed_s);
    late_n_ = std::max(late_n_, glm::distance(force_n, before.force_n));
    count_ = 0;
  }
  newest_ = (newest_ + 1) % ring_.size();
  count_ = std::min(count_ + 1, ring_.size());
  const double now_s = before.time_s + passed_s, from_s = now_s - kWindow_s;
  ring_[newest_] = {now_s, force_n};

  // The last tick at or before the beginning of the window, and no older ones.
  size_t oldest = 0;
  while (oldest + 1 < count_ && at(oldest).time_s > from_s) ++oldest;
  count_ = oldest + 1;
  glm::dvec3 from_n = at(oldest).force_n;
  if (oldest > 0 && at(oldest).time_s < from_s) {
    const TimedForce &a = at(oldest), &b = at(oldest - 1);
    from_n += (from_s - a.time_s) / (b.time_s - a.time_s) * (b.force_n - a.force_n);
  }
  largest_n_ = std::max(largest_n_, glm::distance(force_n, from_n));
}

}  // namespace palpate::running
