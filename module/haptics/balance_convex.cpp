#include "module/haptics/balance_convex.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr double kUlp = 0x1p-52;
constexpr double kShrink = 1e-3;
constexpr int kEasySteps = 12;
constexpr double kSmallestPlace = 1e-3;
constexpr double kLeastWidth = 1e-8;

template <class Real>
glm::vec<3, Real> unit_or_zero(glm::vec<3, Real> v) noexcept {
  const Real length = glm::length(v);
  return length > Real(0) ? v / length : glm::vec<3, Real>(Real(0));
}

template <class Real>
Real size(glm::vec<3, Real> v) noexcept {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

}  // namespace

template <class Real>
void ConvexBalance<Real>::add_plane(glm::dvec3 position, glm::dvec3 q, double strength_n) noexcept {
  Plane& plane = planes_[plane_count_++];
  plane.position = position;
  plane.q = unit_or_zero(Vec(q));
  plane.reach = strength_n / stiffness_;
  plane.step = plane.force = plane.next_force = 0.0;
  plane.held = plane.would_hold = false;
}

template <class Real>
void ConvexBalance<Real>::add_line(glm::dvec3 position, glm::dvec3 q, double strength_n) noexcept {
  Line& line = lines_[line_count_++];
  line.position = position;
  line.q = unit_or_zero(Vec(q));
  line.reach = strength_n / stiffness_;
  line.step = line.force = line.next_force = Vec(0.0);
  line.held = line.would_hold = false;
}

template <class Real>
void ConvexBalance<Real>::add_point(glm::dvec3 position, double strength_n) noexcept {
  add_line(position, glm::dvec3(0.0), strength_n);
}

template <class Real>
void ConvexBalance<Real>::start() noexcept {
  if (!started_) proxy_ = plane_count_ ? planes_[0].position : lines_[0].position;
  started_ = true;
  smallest_ = HUGE_VAL;
  place();
  Real widest = 0.0, reaches = 0.0;
  for (size_t i = 0; i < plane_count_; ++i) {
    const Plane& plane = planes_[i];
    widest = std::max<Real>(widest, std::abs(plane.height - glm::dot(plane.q, spring_)));
    reaches += plane.reach;
  }
  for (size_t i = 0; i < line_count_; ++i) {
    const Line& line = lines_[i];
    const Vec at_probe = line.offset - spring_ + line.q * glm::dot(line.q, spring_);
    widest = std::max<Real>(widest, size(at_probe));
    reaches += line.reach;
  }
  const Real width = 0.03 * std::min<Real>(widest, reaches);
  for (size_t i = 0; i < plane_count_; ++i) {
    Plane& plane = planes_[i];
    plane.slack = slack(plane.position);
    smallest_ = std::min<Real>(smallest_, plane.slack);
    plane.width = std::max<Real>({width, kLeastWidth * plane.reach, 0.5 * plane.slack});
  }
  for (size_t i = 0; i < line_count_; ++i) {
    Line& line = lines_[i];
    line.slack = slack(line.position);
    smallest_ = std::min<Real>(smallest_, line.slack);
    line.width = std::max<Real>({width, kLeastWidth * line.reach, 0.5 * line.slack});
  }
  tolerance_ = std::max<Real>(0.1 * kResidualN / stiffness_, kUlp * (reaches + size(spring_)));
}

template <class Real>
Real ConvexBalance<Real>::slack(Vec position) const noexcept {
  return 4.0 * kUlp * std::max<Real>({size(position), size(probe_), kSmallestPlace});
}

/// Offsets from the proxy as it is: once near the solution, so that they carry the round-off of
/// positions near to each other only.
template <class Real>
void ConvexBalance<Real>::place() noexcept {
  proxy_ += proxy_low_;
  proxy_low_ = Vec(0.0);
  spring_ = proxy_ - probe_;
  for (size_t i = 0; i < plane_count_; ++i)
    planes_[i].height = glm::dot(planes_[i].q, proxy_ - planes_[i].position);
  for (size_t i = 0; i < line_count_; ++i) {
    Line& line = lines_[i];
    const Vec from = proxy_ - line.position;
    line.offset = from - line.q * glm::dot(line.q, from);
  }
}

/// rest_, curvature_ and the forces at proxy + along * newton_step_. Predicted: as if the same
/// primitives held as at the last evaluation that was not.
template <class Real>
template <bool kPredicted>
void ConvexBalance<Real>::evaluate(Real along) noexcept {
  Vec rest = spring_ + along * newton_step_;
  Matrix a{1.0, 0.0, 0.0, 1.0, 0.0, 1.0};
  const auto add = [&a](Real c, Vec v) {
    a.xx += c * v.x * v.x;
    a.xy += c * v.x * v.y;
    a.xz += c * v.x * v.z;
    a.yy += c * v.y * v.y;
    a.yz += c * v.y * v.z;
    a.zz += c * v.z * v.z;
  };
  for (size_t i = 0; i < plane_count_; ++i) {
    Plane& plane = planes_[i];
    const Real c = plane.reach / plane.width;
    const Real wanted = plane.force - c * (plane.height + along * plane.step);
    if constexpr (kPredicted) {
      plane.next_force = plane.held ? wanted : plane.force;
    } else {
      plane.next_force = std::clamp<Real>(wanted, 0.0, plane.reach);
      plane.would_hold = wanted == plane.next_force;
    }
    rest -= plane.next_force * plane.q;
    if (kPredicted ? plane.held : plane.would_hold) add(c, plane.q);
  }
  for (size_t i = 0; i < line_count_; ++i) {
    Line& line = lines_[i];
    Real c = line.reach / line.width;
    Vec wanted = line.force - c * (line.offset + along * line.step);
    wanted -= line.q * glm::dot(line.q, wanted);
    const Real length2 = glm::dot(wanted, wanted);
    line.next_force = wanted;
    if constexpr (!kPredicted) line.would_hold = length2 <= line.reach * line.reach;
    if (!(kPredicted ? line.held : line.would_hold)) {
      const Real inverse = 1.0 / std::sqrt(length2);
      line.next_force *= line.reach * inverse;
      c *= line.reach * inverse;
      add(-c, wanted * inverse);
    }
    rest -= line.next_force;
    add(-c, line.q);
    a.xx += c;
    a.yy += c;
    a.zz += c;
  }
  rest_ = rest;
  curvature_ = a;
}

template <class Real>
void ConvexBalance<Real>::step_to(Real along) noexcept {
  const Vec step = along * newton_step_;
  spring_ += step;
  const Vec sum = proxy_ + (proxy_low_ + step);
  proxy_low_ = (proxy_ - sum) + (proxy_low_ + step);
  proxy_ = sum;
  for (size_t i = 0; i < plane_count_; ++i) planes_[i].height += along * planes_[i].step;
  for (size_t i = 0; i < line_count_; ++i) lines_[i].offset += along * lines_[i].step;
}

/// LDL^T. The matrix is the identity and more, so in exact numbers no pivot is below 1.
template <class Real>
auto ConvexBalance<Real>::solve(const Matrix& a, Vec b) noexcept -> Vec {
  const Real d0 = a.xx;
  const Real l1 = a.xy / d0, l2 = a.xz / d0;
  const Real d1 = std::max<Real>(a.yy - l1 * a.xy, 1.0);
  const Real m = a.yz - l1 * a.xz;
  const Real l3 = m / d1;
  const Real d2 = std::max<Real>(a.zz - l2 * a.xz - l3 * m, 1.0);
  const Real y1 = b.y - l1 * b.x;
  const Real y2 = b.z - l2 * b.x - l3 * y1;
  const Real z = y2 / d2;
  const Real y = y1 / d1 - l3 * z;
  return {b.x / d0 - l1 * y - l2 * z, y, z};
}

/// Where along (0, 1) a primitive starts or ends to give all it can: between two such places the
/// gradient along the step is smooth.
template <class Real>
size_t ConvexBalance<Real>::kinks(std::array<Real, kMaxKinks>& places) const noexcept {
  size_t count = 0;
  const auto add = [&](Real place) {
    if (place > 0.0 && place < 1.0) places[count++] = place;
  };
  for (size_t i = 0; i < plane_count_; ++i) {
    const Plane& plane = planes_[i];
    const Real c = plane.reach / plane.width;
    const Real none = plane.force / c - plane.height;  // where the force ends
    add(none / plane.step);
    add((none - plane.width) / plane.step);
  }
  for (size_t i = 0; i < line_count_; ++i) {
    const Line& line = lines_[i];
    const Vec from = line.offset - line.force * (line.width / line.reach);
    const Real a = glm::dot(line.step, line.step);
    const Real nearest = -glm::dot(from, line.step) / a;
    const Vec at_nearest = from + nearest * line.step;
    const Real left = line.width * line.width - glm::dot(at_nearest, at_nearest);
    if (!(left > 0.0)) {
      add(nearest);  // no kink, but a sharp bend
      continue;
    }
    const Real half = std::sqrt(left / a);
    add(nearest - half);
    add(nearest + half);
  }
  return count;
}

/// How far to go along the Newton step; slope < 0 is the gradient along it at 0. The gradient
/// along it only grows. Leaves evaluate() at the result.
template <class Real>
Real ConvexBalance<Real>::search(Real slope, bool strict) noexcept {
  const Real enough = -0.1 * slope;
  const Real enough_beyond = strict ? 0.0 : enough;
  evaluate(1.0);
  Real at_high = glm::dot(rest_, newton_step_);
  if (at_high <= enough_beyond || glm::length(rest_) <= tolerance_) return 1.0;
  Real low = 0.0, high = 1.0, at_low = slope;
  std::array<Real, kMaxKinks> places;
  size_t first = 0, last = kinks(places);
  std::sort(places.begin(), places.begin() + last);
  while (first < last) {
    const size_t middle = (first + last) / 2;
    evaluate(places[middle]);
    const Real at = glm::dot(rest_, newton_step_);
    if (at >= -enough && at <= enough_beyond) return places[middle];
    if (at < 0.0) {
      low = places[middle];
      at_low = at;
      first = middle + 1;
    } else {
      high = places[middle];
      at_high = at;
      last = middle;
    }
  }
  Real along = 0.0;
  for (int k = 0; k < 12; ++k) {
    along = low + (high - low) * (at_low / (at_low - at_high));
    evaluate(along);
    const Real at = glm::dot(rest_, newton_step_);
    if (at >= -enough && at <= enough_beyond) return along;
    if (at < 0.0) {
      low = along;
      at_low = at;
      at_high *= 0.5;
    } else {
      high = along;
      at_high = at;
      at_low *= 0.5;
    }
  }
  if (strict && low > 0.0) {
    along = low;
    evaluate(along);
  }
  return along;
}

/// The Newton step from here, and how each offset changes along it.
template <class Real>
void ConvexBalance<Real>::aim() noexcept {
  newton_step_ = -solve(curvature_, rest_);
  for (size_t i = 0; i < plane_count_; ++i) planes_[i].step = glm::dot(planes_[i].q, newton_step_);
  for (size_t i = 0; i < line_count_; ++i) {
    Line& line = lines_[i];
    line.step = newton_step_ - line.q * glm::dot(line.q, newton_step_);
  }
  farthest_ = std::max<Real>(farthest_, size(newton_step_));
}

/// A new round seldom changes which primitives hold: goes to where the round would end if it did
/// not, if that is the better place to start from.
template <class Real>
void ConvexBalance<Real>::predict() noexcept {
  evaluate(0.0);
  const Real before = glm::length(rest_);
  if (before <= tolerance_) return;
  evaluate<true>(0.0);
  aim();
  evaluate(1.0);
  ++iterations_;
  if (glm::length(rest_) < before)
    step_to(1.0);
  else
    evaluate(0.0);
}

template <class Real>
bool ConvexBalance<Real>::newton() noexcept {
  int steps = 0;
  while (glm::length(rest_) > tolerance_) {
    if (iterations_ >= kMaxIterations) return false;
    ++iterations_;
    aim();
    const Real slope = glm::dot(rest_, newton_step_);
    if (!(slope < 0.0)) return false;  // round-off is all that is left, or not a number
    step_to(search(slope, ++steps > kEasySteps));
  }
  return true;
}

/// Takes the forces of this round; true if no primitive is wrong by more than round-off, else
/// smaller widths for those that are.
template <class Real>
bool ConvexBalance<Real>::end_round() noexcept {
  bool done = farthest_ * kUlp <= 0.1 * smallest_;
  for (size_t i = 0; i < plane_count_; ++i) {
    Plane& plane = planes_[i];
    const Real wrong = std::abs(plane.next_force - plane.force) * plane.width / plane.reach;
    plane.force = plane.next_force;
    plane.held = plane.would_hold;
    if (wrong <= plane.slack) continue;
    done = false;
    plane.width = std::max<Real>(plane.width * kShrink, 0.5 * plane.slack);
  }
  for (size_t i = 0; i < line_count_; ++i) {
    Line& line = lines_[i];
    const Real wrong = glm::length(line.next_force - line.force) * line.width / line.reach;
    line.force = line.next_force;
    line.held = line.would_hold;
    if (wrong <= line.slack) continue;
    done = false;
    line.width = std::max<Real>(line.width * kShrink, 0.5 * line.slack);
  }
  return done;
}

template <class Real>
Balance ConvexBalance<Real>::solve(bool shares_matter, BalanceHint::Stage* hint) noexcept {
  iterations_ = settle_steps_ = 0;
  start();
  shares_matter_ = false;
  bool done = hint && settle_as(*hint);
  shares_matter_ = shares_matter;
  for (int round = 0; round < kMaxRounds && !done; ++round) {
    farthest_ = 0.0;
    newton_step_ = Vec(0.0);
    if (round == 0)
      evaluate(0.0);
    else
      predict();
    newton();
    done = end_round() || settle();
    if (round == 0 || farthest_ * kUlp > 0.1 * smallest_) place();
  }
  if (hint && done) remember(*hint);
  Balance result;
  result.proxy = glm::dvec3(proxy_ + proxy_low_);
  result.iterations = iterations_ + settle_steps_;
  result.residual_n = double(stiffness_ * glm::length(rest_));
  result.converged = done && result.residual_n <= kResidualN;
  return result;
}

template class ConvexBalance<double>;
template class ConvexBalance<long double>;

}  // namespace palpate
