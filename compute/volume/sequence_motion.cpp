#include "compute/volume/sequence_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate {

TimeWeights TimeBasis::at(double time_s) const noexcept {
  const auto frames = int(times_s.size());
  double t = std::isfinite(time_s) ? time_s : 0.0;
  if (cycle_s > 0.0) t = std::fmod(std::fmod(t, cycle_s) + cycle_s, cycle_s);
  if (harmonics > 0) {
    TimeWeights weights;
    weights.count = int(terms());
    weights.weight[0] = 1.0F;
    for (int n = 1; n < weights.count; ++n) {
      const double angle = 2.0 * std::numbers::pi * double((n + 1) / 2) * t / cycle_s;
      weights.term[size_t(n)] = n;
      weights.weight[size_t(n)] = float(n % 2 == 1 ? std::cos(angle) : std::sin(angle));
    }
    return weights;
  }
  const auto after = int(std::upper_bound(times_s.begin(), times_s.end(), t) - times_s.begin());
  const int frame = std::max(0, after - 1);
  if (after == frames && cycle_s <= 0.0) return at(frames - 1, 0.0);
  const double from = times_s[size_t(frame)];
  const double to = after == frames ? cycle_s : times_s[size_t(frame) + 1];
  return at(frame, t <= from ? 0.0 : (t - from) / (to - from));
}

TimeWeights TimeBasis::at(int frame, double phase) const noexcept {
  const auto frames = int(times_s.size());
  const bool is_last = frame + 1 >= frames;
  if (harmonics > 0) {
    const double from = times_s[size_t(frame)];
    return at(from + phase * ((is_last ? cycle_s : times_s[size_t(frame) + 1]) - from));
  }
  TimeWeights weights;
  weights.count = phase > 0.0 && frames > 1 ? 2 : 1;
  weights.term[0] = frame;
  weights.term[1] = is_last ? (cycle_s > 0.0 ? 0 : frame) : frame + 1;
  weights.weight[0] = float(1.0 - phase);
  weights.weight[1] = float(phase);
  return weights;
}

double cycle_of(std::span<const double> times_s) {
  std::vector<double> steps;
  for (size_t k = 1; k < times_s.size(); ++k) steps.push_back(times_s[k] - times_s[k - 1]);
  const auto middle = steps.begin() + ptrdiff_t((steps.size() - 1) / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return times_s.back() - times_s.front() + *middle;
}

Field combined(const std::vector<Field>& fields, const TimeWeights& weights) {
  Field sum = still_field(fields.front().grid);
  for (int n = 0; n < weights.count; ++n) {
    const Field& field = fields[size_t(weights.term[size_t(n)])];
    const float weight = weights.weight[size_t(n)];
    for (size_t s = 0; s < sum.u_mm.size(); ++s) sum.u_mm[s] += weight * field.u_mm[s];
  }
  return sum;
}

Field SequenceMotion::at(double time_s) const {
  return combined(terms, basis.at(time_s));
}

}  // namespace palpate
