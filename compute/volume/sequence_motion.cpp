#include "compute/volume/sequence_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate {

double TimeBasis::step_s(int frame) const noexcept {
  const double to = frame + 1 < int(times_s.size()) ? times_s[size_t(frame) + 1] : cycle_s;
  return to - times_s[size_t(frame)];
}

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
  const auto add = [&](int term, double weight) {
    weights.term[size_t(weights.count)] = term;
    weights.weight[size_t(weights.count++)] = float(weight);
  };
  const bool cyclic = cycle_s > 0.0;
  if (!(phase > 0.0) || frames < 2 || (is_last && !cyclic)) {
    add(frame, 1.0);
    return weights;
  }
  // Hermite's polynomial between the frame and the next one. The slope at a frame is that of the
  // parabola through it and its two neighbours; at an open end that of the only step there.
  const int next = (frame + 1) % frames, before = (frame + frames - 1) % frames;
  const double length = step_s(frame), s = phase, r = 1.0 - phase;
  const double slope_here = s * r * r * length, slope_next = -s * s * r * length;
  double here = r * r * (1.0 + 2.0 * s), there = s * s * (1.0 + 2.0 * r);
  if (cyclic || frame > 0) {
    const double last = step_s(before), both = last + length;
    add(before, -slope_here * length / (last * both));
    here += slope_here * (length / last - last / length) / both;
    there += slope_here * last / (length * both);
  } else {
    here -= slope_here / length;
    there += slope_here / length;
  }
  if (cyclic || next + 1 < frames) {
    const double after = step_s(next), both = length + after;
    add((next + 1) % frames, slope_next * length / (after * both));
    here -= slope_next * after / (length * both);
    there += slope_next * (after / length - length / after) / both;
  } else {
    here -= slope_next / length;
    there += slope_next / length;
  }
  add(frame, here);
  add(next, there);
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
