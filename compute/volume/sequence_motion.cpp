#include "compute/volume/sequence_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "compute/volume/portable.h"

namespace palpate {
namespace {

/// The clock is at most 4/27 of this away from the share of the step that is done.
constexpr double kMostAhead = 0.2;
/// With slopes at both ends of 0 to 3 times the step a cubic rises or falls all the way (Fritsch
/// and Carlson).
constexpr float kSteepest = 3.0F;

double excess(double own_s, double neighbour_s) noexcept {
  return (own_s - neighbour_s) / (own_s + neighbour_s);
}

/// How far the clock is ahead at the share p if it starts with the rate 1 + e instead of 1.
double ahead(double p, double e) noexcept {
  const double width = std::abs(e) > kMostAhead ? kMostAhead / std::abs(e) : 1.0;
  if (p >= width) return 0.0;
  const double left = 1.0 - p / width;
  return e * p * left * left;
}

/// The steepest slope at either end of a step, between the step before and the one after it.
float steepest(float before, float step, float after) noexcept {
  const float turn = before * after < 0.0F ? std::min(std::abs(before), std::abs(after)) : 0.0F;
  return kSteepest * (std::abs(step) + turn);
}

void add_to(Field& sum, const Field& field, float weight) {
  for (size_t s = 0; s < sum.u_mm.size(); ++s) sum.u_mm[s] += weight * field.u_mm[s];
}

}  // namespace

double TimeBasis::step_s(int frame) const noexcept {
  const double to = frame + 1 < frames_of_path() ? times_s[size_t(frame) + 1] : cycle_s;
  return to - times_s[size_t(frame)];
}

/// What the clock has done of its step when `phase` of the time has passed: s - k.
double TimeBasis::share(int frame, double phase) const noexcept {
  const int frames = frames_of_path();
  const bool cyclic = cycle_s > 0.0;
  const double own = step_s(frame);
  const double before = cyclic || frame > 0 ? step_s((frame + frames - 1) % frames) : own;
  const double after = cyclic || frame + 2 < frames ? step_s((frame + 1) % frames) : own;
  return phase + ahead(phase, excess(own, before)) - ahead(1.0 - phase, excess(own, after));
}

TimeWeights TimeBasis::at(double time_s) const noexcept {
  double t = std::isfinite(time_s) ? time_s : 0.0;
  if (cycle_s > 0.0) t = std::fmod(std::fmod(t, cycle_s) + cycle_s, cycle_s);
  const int frames = frames_of_path();
  const auto end = times_s.begin() + frames;
  const auto after = int(std::upper_bound(times_s.begin(), end, t) - times_s.begin());
  const int frame = std::max(0, after - 1);
  if (after == frames && cycle_s <= 0.0) return at(frames - 1, 0.0);
  return at(frame, (t - times_s[size_t(frame)]) / step_s(frame));
}

TimeWeights TimeBasis::at(int frame, double phase) const noexcept {
  const int frames = frames_of_path();
  if (frame >= frames)
    return at(times_s[size_t(frame)] + phase * (cycle_s - times_s[size_t(frame)]));
  const bool stands = frames < 2 || (frame + 1 >= frames && cycle_s <= 0.0);
  // In this order NaN becomes 0.
  const double q = phase > 0.0 && !stands ? share(frame, std::min(phase, 1.0)) : 0.0;
  TimeWeights weights;
  const auto add = [&](int term, double weight) {
    weights.term[size_t(weights.count)] = term;
    weights.weight[size_t(weights.count++)] = float(weight);
  };
  if (harmonics > 0) {
    add(0, 1.0);
    for (int n = 1; n < int(terms()); ++n) {
      const double angle = 2.0 * std::numbers::pi * double((n + 1) / 2) * (frame + q) / frames;
      add(n, n % 2 == 1 ? portable::cos(angle) : portable::sin(angle));
    }
    return weights;
  }
  if (q == 0.0) {
    add(frame, 1.0);
    return weights;
  }
  const int next = (frame + 1) % frames;
  const double r = 1.0 - q;
  add(frame, r * r * (1.0 + 2.0 * q));
  add(next, q * q * (1.0 + 2.0 * r));
  add(int(terms()) + frame, q * r * r);
  add(int(terms()) + next, -q * q * r);
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
  for (int n = 0; n < weights.count; ++n)
    add_to(sum, fields[size_t(weights.term[size_t(n)])], weights.weight[size_t(n)]);
  return sum;
}

Field SequenceMotion::at(const TimeWeights& time) const {
  Field sum = still_field(terms.front().grid);
  for (int n = 0; n < time.count; ++n) {
    const auto term = size_t(time.term[size_t(n)]);
    add_to(sum, term < terms.size() ? terms[term] : summand(term), time.weight[size_t(n)]);
  }
  return sum;
}

Field SequenceMotion::summand(size_t n) const {
  if (n < terms.size()) return terms[n];
  const int count = basis.frames_of_path(), frame = int(n - terms.size());
  // The steps before and after the frame, and those beside them; none is a step of 0.
  const auto step = [&](int k, size_t s) {
    if (basis.cycle_s > 0.0)
      k = (k + 2 * count) % count;
    else if (k < 0 || k + 1 >= count)
      return glm::vec3(0.0F);
    return terms[size_t((k + 1) % count)].u_mm[s] - terms[size_t(k)].u_mm[s];
  };
  if (frame >= count) return still_field(terms.front().grid);
  const bool at_end = basis.cycle_s <= 0.0 && (frame == 0 || frame + 1 == count);
  Field slopes = still_field(terms.front().grid);
  for (size_t s = 0; s < slopes.u_mm.size(); ++s) {
    const glm::vec3 came = step(frame - 1, s), goes = step(frame, s);
    slopes.u_mm[s] = at_end ? came + goes : 0.5F * (came + goes);
    if (at_end) continue;
    const glm::vec3 before = step(frame - 2, s), after = step(frame + 1, s);
    for (int axis = 0; axis < 3; ++axis) {
      const float most = std::min(steepest(before[axis], came[axis], goes[axis]),
                                  steepest(came[axis], goes[axis], after[axis]));
      slopes.u_mm[s][axis] = std::clamp(slopes.u_mm[s][axis], -most, most);
    }
  }
  return slopes;
}

}  // namespace palpate
