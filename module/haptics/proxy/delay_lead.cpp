#include "module/haptics/proxy/delay_lead.h"

#include <limits>

#include "module/haptics/force_vector.h"

namespace palpate {
namespace {

constexpr double kLongestGapPeriods = 8.0;

}  // namespace

double stable_stiffness(double damping_n_s_per_m, double period_s, double delay_s) noexcept {
  const double late_s = 0.5 * period_s + delay_s;
  if (!(late_s > 0.0)) return std::numeric_limits<double>::infinity();
  return damping_n_s_per_m / late_s;
}

DelayLead::DelayLead(double period_s, double delay_s, double share) noexcept {
  const double lead_s = share * (0.5 * period_s + delay_s);
  if (!(period_s > 0.0 && period_s < 1.0) || !(lead_s > 0.0 && lead_s < 1.0)) return;
  lead_s_ = lead_s;
  longest_gap_ns_ = int64_t(kLongestGapPeriods * period_s * 1e9);
}

glm::dvec3 DelayLead::add(int64_t time_ns, glm::dvec3 position_m) noexcept {
  if (!is_finite(position_m)) {
    count_ = 0;
    return position_m;
  }
  if (count_ > 0) {
    // Unsigned, so that no pair of times overflows.
    const bool set_back = time_ns < past_[0].time_ns;
    const uint64_t gap = set_back ? uint64_t(past_[0].time_ns) - uint64_t(time_ns)
                                  : uint64_t(time_ns) - uint64_t(past_[0].time_ns);
    if (gap > uint64_t(longest_gap_ns_)) {
      count_ = 0;
    } else if (gap == 0 || set_back) {
      return answer_m_;
    }
  }
  answer_m_ = position_m;
  if (count_ > 0) {
    const DelayedForce& before = past_[count_ - 1];
    const double dt_s = double(time_ns - before.time_ns) * 1e-9;
    const glm::dvec3 led = position_m + (position_m - before.position_m) * (lead_s_ / dt_s);
    if (is_finite(led)) answer_m_ = led;
  }
  past_[1] = past_[0];
  past_[0] = {time_ns, position_m};
  if (count_ < 2) ++count_;
  return answer_m_;
}

}  // namespace palpate
