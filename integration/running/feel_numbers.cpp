#include "integration/running/feel_numbers.h"

#include <algorithm>
#include <iterator>

namespace palpate::running {
namespace {

void count_cause(FeelNumbers& numbers, const TickRow& row) {
  if (row.cause == Cause::kNone) return;
  const DeviceFault fault = row.cause == Cause::kDevice ? row.fault : DeviceFault::kNone;
  for (CauseTime& known : numbers.causes)
    if (known.cause == row.cause && known.fault == fault) {
      known.seconds += row.dt_s;
      return;
    }
  numbers.causes.push_back({row.cause, fault, row.dt_s, row.time_s});
}

}  // namespace

void FeelCounter::add(const TickRow& row, const ForceLedger& ledger, double hand_work_j) {
  const double dt = std::clamp(row.dt_s, 0.0, 0.1);
  sums_.seconds += dt;
  const double force = glm::length(row.force_n);
  sums_.most_force_n = std::max(sums_.most_force_n, force);
  change_.add(row.dt_s, row.force_n);
  if (row.in_contact) {
    sums_.touched_s += dt;
    sums_.mean_force_n += force * dt;
    sums_.deepest_m = std::max(sums_.deepest_m, glm::distance(row.probe_m, row.proxy_m));
  }
  sums_.worst_residual_m = std::max(sums_.worst_residual_m, row.residual_m);
  sums_.most_newton_steps = std::max(sums_.most_newton_steps, int(row.newton_steps));
  sums_.frozen += row.frozen;
  count_cause(sums_, row);
  sums_.hand_work_j = hand_work_j;
  for (size_t k = 0; k < kLimiters; ++k) {
    const double held_n = glm::length(ledger.held_n[k]);
    held_[k].limiter = Limiter(k);
    held_[k].seconds += held_n > kHeldBack_n ? dt : 0.0;
    held_[k].most_n = std::max(held_[k].most_n, held_n);
  }
}

FeelNumbers FeelCounter::numbers() const {
  FeelNumbers numbers = sums_;
  numbers.steepest_n_per_ms = change_.largest_n_per_ms();
  numbers.late_ticks = change_.late_ticks();
  numbers.latest_s = change_.latest_s();
  numbers.late_change_n = change_.largest_late_n();
  if (numbers.touched_s > 0.0) numbers.mean_force_n /= numbers.touched_s;
  std::copy_if(held_.begin(), held_.end(), std::back_inserter(numbers.held),
               [](const LimiterTime& of) { return of.seconds > 0.0; });
  std::sort(numbers.causes.begin(), numbers.causes.end(),
            [](const CauseTime& a, const CauseTime& b) { return a.seconds > b.seconds; });
  return numbers;
}

bool TickHistory::is_larger(const TickRow& a, const TickRow& b) {
  const bool a_has_cause = a.cause != Cause::kNone, b_has_cause = b.cause != Cause::kNone;
  if (a_has_cause != b_has_cause) return a_has_cause;
  return glm::dot(a.force_n, a.force_n) > glm::dot(b.force_n, b.force_n);
}

TickHistory::TickHistory() {
  // Written once, so that all memory is allocated at the start and the process does not grow later.
  rows_.resize(kMostRows);
  rows_.clear();
}

TickRow* TickHistory::put(const TickRow& smallest, const TickRow& largest, TickRow* to) {
  const std::array<TickRow, 2> both = {smallest, largest};
  const size_t first = smallest.time_s <= largest.time_s ? 0 : 1;
  *to++ = both[first];
  if (smallest.time_s != largest.time_s) *to++ = both[1 - first];
  return to;
}

void TickHistory::add(const TickRow& row) {
  if (rows_.size() + 2 > kMostRows) thin();
  if (count_ == 0 || is_larger(smallest_, row)) smallest_ = row;
  if (count_ == 0 || is_larger(row, largest_)) largest_ = row;
  if (++count_ < group_) return;
  std::array<TickRow, 2> kept;
  rows_.insert(rows_.end(), kept.data(), put(smallest_, largest_, kept.data()));
  count_ = 0;
}

/// Reduces four rows to two, in place: their smallest and their largest.
void TickHistory::thin() {
  TickRow* to = rows_.data();
  for (size_t first = 0; first < rows_.size(); first += 4) {
    const auto begin = rows_.begin() + ptrdiff_t(first);
    const auto end = rows_.begin() + ptrdiff_t(std::min(first + 4, rows_.size()));
    const auto [smallest, largest] = std::minmax_element(
        begin, end, [](const TickRow& a, const TickRow& b) { return is_larger(b, a); });
    to = put(*smallest, *largest, to);
  }
  rows_.resize(size_t(to - rows_.data()));
  group_ = group_ == 1 ? 4 : 2 * group_;
}

}  // namespace palpate::running
