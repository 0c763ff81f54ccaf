#include "module/haptics/proxy/balance_convex.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace palpate {
namespace {

constexpr double kUlp = 0x1p-52;
constexpr double kShrink = 1e-3;
constexpr int kEasySteps = 12;
constexpr double kSmallestPlace = 1e-3;
constexpr double kLeastWidth = 1e-8;

glm::dvec3 unit_or_zero(glm::dvec3 v) noexcept {
  const double length = glm::length(v);
  return length > 0.0 ? v / length : glm::dvec3(0.0);
}

double size(glm::dvec3 v) noexcept {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

// A constraint that leaves the span of the others by less than this sine is taken to be within it.
constexpr double kWithin = 1e-3;
constexpr int kMostSteps = 8;

/// Up to three active directions, made orthogonal one after the other.
class ActiveSpan {
 public:
  /// False if it lies within the span already.
  bool add(glm::dvec3 normal) noexcept {
    glm::dvec3 rest = normal;
    for (int k = 0; k < count_; ++k) rest -= base_[k] * glm::dot(base_[k], rest);
    const double length = glm::length(rest);
    if (count_ == 3 || length < kWithin) return false;
    normals_[count_] = normal;
    base_[count_++] = rest / length;
    return true;
  }
  int count() const noexcept { return count_; }
  glm::dvec3 outside(glm::dvec3 v) const noexcept {
    for (int k = 0; k < count_; ++k) v -= base_[k] * glm::dot(base_[k], v);
    return v;
  }
  /// A symmetric matrix along what is free only; the identity along the span.
  template <class SymmetricMatrix>
  SymmetricMatrix free_part(const SymmetricMatrix& a) const noexcept {
    glm::dvec3 rows[3] = {outside({a.xx, a.xy, a.xz}), outside({a.xy, a.yy, a.yz}),
                          outside({a.xz, a.yz, a.zz})};
    glm::dvec3 columns[3];
    for (int c = 0; c < 3; ++c) columns[c] = outside({rows[0][c], rows[1][c], rows[2][c]});
    SymmetricMatrix free{columns[0].x, columns[1].x, columns[2].x,
                         columns[1].y, columns[2].y, columns[2].z};
    for (int k = 0; k < count_; ++k) {
      const glm::dvec3 b = base_[k];
      free.xx += b.x * b.x, free.xy += b.x * b.y, free.xz += b.x * b.z;
      free.yy += b.y * b.y, free.yz += b.y * b.z, free.zz += b.z * b.z;
    }
    return free;
  }

  /// The least move that changes the heights over the normals by so much.
  glm::dvec3 move(const double (&heights)[3]) const noexcept {
    // base_k . x, one after the other: normal_k = its part along earlier bases and along its own.
    glm::dvec3 x(0.0);
    for (int k = 0; k < count_; ++k) {
      const double missing = heights[k] - glm::dot(normals_[k], x);
      x += base_[k] * (missing / glm::dot(normals_[k], base_[k]));
    }
    return x;
  }
  /// Shares of the normals that add up to the part of v within the span.
  void shares(glm::dvec3 v, double (&out)[3]) const noexcept {
    for (int k = count_ - 1; k >= 0; --k) {
      out[k] = glm::dot(v, base_[k]) / glm::dot(normals_[k], base_[k]);
      v -= out[k] * normals_[k];
    }
  }

 private:
  glm::dvec3 normals_[3], base_[3];
  int count_ = 0;
};

/// Two directions at right angles to a line; all three axes for a point.
int across(glm::dvec3 q, glm::dvec3 (&out)[3]) noexcept {
  if (q == glm::dvec3(0.0)) {
    out[0] = glm::dvec3(1, 0, 0), out[1] = glm::dvec3(0, 1, 0), out[2] = glm::dvec3(0, 0, 1);
    return 3;
  }
  const glm::dvec3 axis = std::abs(q.x) < double(0.6) ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  out[0] = glm::normalize(glm::cross(q, axis));
  out[1] = glm::cross(q, out[0]);
  return 2;
}

}  // namespace

void ConvexBalance::add_plane(glm::dvec3 position, glm::dvec3 q, double strength_n) noexcept {
  Plane& plane = planes_[plane_count_++];
  plane.position = position;
  plane.q = unit_or_zero(q);
  plane.reach = strength_n / stiffness_;
  plane.step = plane.force = plane.next_force = 0.0;
  plane.active = plane.would_be_active = false;
}

void ConvexBalance::add_line(glm::dvec3 position, glm::dvec3 q, double strength_n) noexcept {
  Line& line = lines_[line_count_++];
  line.position = position;
  line.q = unit_or_zero(q);
  line.reach = strength_n / stiffness_;
  line.step = line.force = line.next_force = glm::dvec3(0.0);
  line.active = line.would_be_active = false;
}

void ConvexBalance::add_point(glm::dvec3 position, double strength_n) noexcept {
  add_line(position, glm::dvec3(0.0), strength_n);
}

void ConvexBalance::start() noexcept {
  if (!started_) proxy_ = plane_count_ ? planes_[0].position : lines_[0].position;
  started_ = true;
  smallest_ = HUGE_VAL;
  place();

  // How far the primitives are from the probe, and how far they can pull.
  double widest = 0.0, reaches = 0.0;
  for (size_t i = 0; i < plane_count_; ++i) {
    const Plane& plane = planes_[i];
    widest = std::max(widest, std::abs(plane.height - glm::dot(plane.q, spring_)));
    reaches += plane.reach;
  }
  for (size_t i = 0; i < line_count_; ++i) {
    const Line& line = lines_[i];
    const glm::dvec3 at_probe = line.offset - spring_ + line.q * glm::dot(line.q, spring_);
    widest = std::max(widest, size(at_probe));
    reaches += line.reach;
  }

  // Widths of the smoothed forces: a small part of that, never below round-off.
  const double width = 0.03 * std::min(widest, reaches);
  for (size_t i = 0; i < plane_count_; ++i) {
    Plane& plane = planes_[i];
    plane.slack = slack(plane.position);
    smallest_ = std::min(smallest_, plane.slack);
    plane.width = std::max({width, kLeastWidth * plane.reach, 0.5 * plane.slack});
  }
  for (size_t i = 0; i < line_count_; ++i) {
    Line& line = lines_[i];
    line.slack = slack(line.position);
    smallest_ = std::min(smallest_, line.slack);
    line.width = std::max({width, kLeastWidth * line.reach, 0.5 * line.slack});
  }

  // Below this only round-off is left.
  tolerance_ = std::max(0.1 * kResidualN / stiffness_, kUlp * (reaches + size(spring_)));
}

double ConvexBalance::slack(glm::dvec3 position) const noexcept {
  return 4.0 * kUlp * std::max({size(position), size(probe_), kSmallestPlace});
}

/// Offsets from the proxy as it is: once near the solution, so that they carry the round-off of
/// positions near to each other only.
void ConvexBalance::place() noexcept {
  proxy_ += proxy_low_;
  proxy_low_ = glm::dvec3(0.0);
  spring_ = proxy_ - probe_;
  for (size_t i = 0; i < plane_count_; ++i)
    planes_[i].height = glm::dot(planes_[i].q, proxy_ - planes_[i].position);
  for (size_t i = 0; i < line_count_; ++i) {
    Line& line = lines_[i];
    const glm::dvec3 from = proxy_ - line.position;
    line.offset = from - line.q * glm::dot(line.q, from);
  }
}

/// rest_, curvature_ and the forces at proxy + along * newton_step_. Predicted: as if the same
/// primitives were active as at the last evaluation that was not predicted.
template <bool kPredicted>
void ConvexBalance::evaluate(double along) noexcept {
  // The spring: its force, and its curvature, which is 1 in these units.
  glm::dvec3 rest = spring_ + along * newton_step_;
  SymmetricMatrix a{1.0, 0.0, 0.0, 1.0, 0.0, 1.0};
  const auto add = [&a](double c, glm::dvec3 v) {
    a.xx += c * v.x * v.x;
    a.xy += c * v.x * v.y;
    a.xz += c * v.x * v.z;
    a.yy += c * v.y * v.y;
    a.yz += c * v.y * v.z;
    a.zz += c * v.z * v.z;
  };
  for (size_t i = 0; i < plane_count_; ++i) {
    Plane& plane = planes_[i];
    const double c = plane.reach / plane.width;
    const double wanted = plane.force - c * (plane.height + along * plane.step);
    if constexpr (kPredicted) {
      plane.next_force = plane.active ? wanted : plane.force;
    } else {
      plane.next_force = std::clamp(wanted, 0.0, plane.reach);
      plane.would_be_active = wanted == plane.next_force;
    }
    rest -= plane.next_force * plane.q;
    if (kPredicted ? plane.active : plane.would_be_active) add(c, plane.q);
  }
  for (size_t i = 0; i < line_count_; ++i) {
    Line& line = lines_[i];
    double c = line.reach / line.width;
    glm::dvec3 wanted = line.force - c * (line.offset + along * line.step);
    wanted -= line.q * glm::dot(line.q, wanted);
    const double length2 = glm::dot(wanted, wanted);
    line.next_force = wanted;
    if constexpr (!kPredicted) line.would_be_active = length2 <= line.reach * line.reach;
    if (!(kPredicted ? line.active : line.would_be_active)) {
      const double inverse = 1.0 / std::sqrt(length2);
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

void ConvexBalance::step_to(double along) noexcept {
  const glm::dvec3 step = along * newton_step_;
  spring_ += step;
  const glm::dvec3 sum = proxy_ + (proxy_low_ + step);
  proxy_low_ = (proxy_ - sum) + (proxy_low_ + step);
  proxy_ = sum;
  for (size_t i = 0; i < plane_count_; ++i) planes_[i].height += along * planes_[i].step;
  for (size_t i = 0; i < line_count_; ++i) lines_[i].offset += along * lines_[i].step;
}

/// LDL^T. The matrix is the identity and more, so in exact numbers no pivot is below 1.
glm::dvec3 ConvexBalance::solve(const SymmetricMatrix& a, glm::dvec3 b) noexcept {
  const double d0 = a.xx;
  const double l1 = a.xy / d0, l2 = a.xz / d0;
  const double d1 = std::max(a.yy - l1 * a.xy, 1.0);
  const double m = a.yz - l1 * a.xz;
  const double l3 = m / d1;
  const double d2 = std::max(a.zz - l2 * a.xz - l3 * m, 1.0);
  const double y1 = b.y - l1 * b.x;
  const double y2 = b.z - l2 * b.x - l3 * y1;
  const double z = y2 / d2;
  const double y = y1 / d1 - l3 * z;
  return {b.x / d0 - l1 * y - l2 * z, y, z};
}

/// Where along (0, 1) a primitive starts or ends to give all it can: between two such places the
/// gradient along the step is smooth.
size_t ConvexBalance::kinks(std::array<double, kMaxKinks>& places) const noexcept {
  size_t count = 0;
  const auto add = [&](double place) {
    if (place > 0.0 && place < 1.0) places[count++] = place;
  };
  for (size_t i = 0; i < plane_count_; ++i) {
    const Plane& plane = planes_[i];
    const double c = plane.reach / plane.width;
    const double none = plane.force / c - plane.height;  // where the force ends
    add(none / plane.step);
    add((none - plane.width) / plane.step);
  }
  for (size_t i = 0; i < line_count_; ++i) {
    const Line& line = lines_[i];
    const glm::dvec3 from = line.offset - line.force * (line.width / line.reach);
    const double a = glm::dot(line.step, line.step);
    const double nearest = -glm::dot(from, line.step) / a;
    const glm::dvec3 at_nearest = from + nearest * line.step;
    const double left = line.width * line.width - glm::dot(at_nearest, at_nearest);
    if (!(left > 0.0)) {
      add(nearest);  // no kink, but a sharp bend
      continue;
    }
    const double half = std::sqrt(left / a);
    add(nearest - half);
    add(nearest + half);
  }
  return count;
}

/// How far to go along the Newton step; slope < 0 is the gradient along it at 0. The gradient
/// along it only grows. Leaves evaluate() at the result.
double ConvexBalance::search(double slope, bool strict) noexcept {
  const double enough = -0.1 * slope;
  const double enough_beyond = strict ? 0.0 : enough;

  // The whole step, if the gradient there is small or still falls.
  evaluate(1.0);
  double at_high = glm::dot(rest_, newton_step_);
  if (at_high <= enough_beyond || glm::length(rest_) <= tolerance_) return 1.0;

  // Between which two kinks the gradient changes its sign: by halving.
  double low = 0.0, high = 1.0, at_low = slope;
  std::array<double, kMaxKinks> places;
  size_t first = 0, last = kinks(places);
  std::sort(places.begin(), places.begin() + last);
  while (first < last) {
    const size_t middle = (first + last) / 2;
    evaluate(places[middle]);
    const double at = glm::dot(rest_, newton_step_);
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

  // Between them it is smooth: regula falsi with the Illinois change.
  double along = 0.0;
  for (int k = 0; k < 12; ++k) {
    along = low + (high - low) * (at_low / (at_low - at_high));
    evaluate(along);
    const double at = glm::dot(rest_, newton_step_);
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
void ConvexBalance::aim() noexcept {
  newton_step_ = -solve(curvature_, rest_);
  for (size_t i = 0; i < plane_count_; ++i) planes_[i].step = glm::dot(planes_[i].q, newton_step_);
  for (size_t i = 0; i < line_count_; ++i) {
    Line& line = lines_[i];
    line.step = newton_step_ - line.q * glm::dot(line.q, newton_step_);
  }
  farthest_ = std::max(farthest_, size(newton_step_));
}

/// A new round seldom changes which primitives hold: goes to where the round would end if it did
/// not, if that is the better place to start from.
void ConvexBalance::predict() noexcept {
  evaluate(0.0);
  const double before = glm::length(rest_);
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

bool ConvexBalance::newton() noexcept {
  int steps = 0;
  while (glm::length(rest_) > tolerance_) {
    if (iterations_ >= kMaxIterations) return false;
    ++iterations_;
    aim();
    const double slope = glm::dot(rest_, newton_step_);
    if (!(slope < 0.0)) return false;  // round-off is all that is left, or not a number
    step_to(search(slope, ++steps > kEasySteps));
  }
  return true;
}

/// Takes the forces of this round; true if no primitive is wrong by more than round-off, else
/// smaller widths for those that are.
bool ConvexBalance::end_round() noexcept {
  bool done = farthest_ * kUlp <= 0.1 * smallest_;
  for (size_t i = 0; i < plane_count_; ++i) {
    Plane& plane = planes_[i];
    const double wrong = std::abs(plane.next_force - plane.force) * plane.width / plane.reach;
    plane.force = plane.next_force;
    plane.active = plane.would_be_active;
    if (wrong <= plane.slack) continue;
    done = false;
    plane.width = std::max(plane.width * kShrink, 0.5 * plane.slack);
  }
  for (size_t i = 0; i < line_count_; ++i) {
    Line& line = lines_[i];
    const double wrong = glm::length(line.next_force - line.force) * line.width / line.reach;
    line.force = line.next_force;
    line.active = line.would_be_active;
    if (wrong <= line.slack) continue;
    done = false;
    line.width = std::max(line.width * kShrink, 0.5 * line.slack);
  }
  return done;
}

Balance ConvexBalance::solve(bool shares_matter, BalanceHint::Stage* hint) noexcept {
  const Balance first = pass(shares_matter, hint);
  if (first.converged) return first;
  Balance second = pass(shares_matter, nullptr);
  second.iterations += first.iterations;
  return second;
}

Balance ConvexBalance::pass(bool shares_matter, BalanceHint::Stage* hint) noexcept {
  iterations_ = exact_steps_ = 0;
  start();
  shares_matter_ = false;
  bool done = hint && solve_active_of(*hint);
  shares_matter_ = shares_matter;
  for (int round = 0; round < kMaxRounds && !done; ++round) {
    farthest_ = 0.0;
    newton_step_ = glm::dvec3(0.0);
    if (round == 0)
      evaluate(0.0);
    else
      predict();
    newton();
    done = end_round() || solve_active();
    if (round == 0 || farthest_ * kUlp > 0.1 * smallest_) place();
  }
  if (hint && done) remember(*hint);
  Balance result;
  result.proxy = proxy_ + proxy_low_;
  result.iterations = iterations_ + exact_steps_;
  result.residual_n = stiffness_ * glm::length(rest_);
  result.converged = done && result.residual_n <= kResidualN;
  return result;
}

/// Everything where the proxy would be: offsets, and spring less forces.
glm::dvec3 ConvexBalance::exact_rest(glm::dvec3 proxy) noexcept {
  glm::dvec3 rest = proxy - probe_;
  for (size_t i = 0; i < plane_count_; ++i) {
    Plane& plane = planes_[i];
    plane.exact_height = glm::dot(plane.q, proxy - plane.position);
    rest -= plane.exact_force * plane.q;
  }
  for (size_t i = 0; i < line_count_; ++i) {
    Line& line = lines_[i];
    // Twice: far along a line, what rounding leaves of that is not small beside a short offset.
    glm::dvec3 offset = proxy - line.position;
    offset -= line.q * glm::dot(line.q, offset);
    line.exact_offset = offset - line.q * glm::dot(line.q, offset);
    const double length = glm::length(line.exact_offset);
    // What slides is pulled back along its offset.
    if (!line.active && length > 0.0) line.exact_force = line.exact_offset * (-line.reach / length);
    rest -= line.exact_force;
  }
  return rest;
}

/// How the spring and the forces of what slides change with the proxy.
ConvexBalance::SymmetricMatrix ConvexBalance::sliding_curvature() const noexcept {
  SymmetricMatrix a{1.0, 0.0, 0.0, 1.0, 0.0, 1.0};
  for (size_t i = 0; i < line_count_; ++i) {
    const Line& line = lines_[i];
    const double length = glm::length(line.exact_offset);
    if (line.active || !(length > 0.0)) continue;
    const double c = line.reach / length;
    const glm::dvec3 o = line.exact_offset / length, q = line.q;
    a.xx += c * (1 - q.x * q.x - o.x * o.x);
    a.xy -= c * (q.x * q.y + o.x * o.y);
    a.xz -= c * (q.x * q.z + o.x * o.z);
    a.yy += c * (1 - q.y * q.y - o.y * o.y);
    a.yz -= c * (q.y * q.z + o.y * o.z);
    a.zz += c * (1 - q.z * q.z - o.z * o.z);
  }
  return a;
}

/// Whether every force is one that its primitive can give where the proxy would be.
bool ConvexBalance::all_can() const noexcept {
  for (size_t i = 0; i < plane_count_; ++i) {
    const Plane& plane = planes_[i];
    const double height = plane.exact_height, force = plane.exact_force;
    const bool can = plane.active
                         ? std::abs(height) <= plane.slack && force >= 0.0 && force <= plane.reach
                     : force > 0.0 ? height <= plane.slack
                                   : height >= -plane.slack;
    if (!can) return false;
  }
  for (size_t i = 0; i < line_count_; ++i) {
    const Line& line = lines_[i];
    const double square = glm::dot(line.exact_offset, line.exact_offset);
    const double force = glm::dot(line.exact_force, line.exact_force);
    const bool can = line.active
                         ? square <= line.slack * line.slack && force <= line.reach * line.reach
                         : square > line.slack * line.slack;
    if (!can) return false;
  }
  return true;
}

/// The active primitives as up to three independent directions; of more only their number matters.
struct ConvexBalance::ActiveSet {
  struct Direction {
    Plane* plane;
    Line* line;
    glm::dvec3 along;
  };

  void hold(Plane* plane, Line* line, glm::dvec3 along) noexcept {
    const auto at = size_t(span.count());
    if (span.add(along))
      directions[at] = {plane, line, along};
    else
      repeats = true;
  }

  ActiveSpan span;
  std::array<Direction, 3> directions{};
  bool repeats = false;  ///< more are active than are independent
};

/// Begins solve_active(): exact forces are the present ones.
ConvexBalance::ActiveSet ConvexBalance::active_set() noexcept {
  ActiveSet active;
  for (size_t i = 0; i < plane_count_; ++i) {
    planes_[i].exact_force = planes_[i].force;
    if (planes_[i].active) active.hold(&planes_[i], nullptr, planes_[i].q);
  }
  for (size_t i = 0; i < line_count_; ++i) {
    lines_[i].exact_force = lines_[i].force;
    if (!lines_[i].active) continue;
    glm::dvec3 axes[3];
    const int count = across(lines_[i].q, axes);
    for (int a = 0; a < count; ++a) active.hold(nullptr, &lines_[i], axes[a]);
  }
  return active;
}

/// Takes a proxy to where the active ones hold exactly, and along what is left free to where spring
/// and forces balance. rest: what is left of spring and forces there. False if it is not reached.
bool ConvexBalance::go_to_active(const ActiveSet& active, glm::dvec3& proxy,
                                 glm::dvec3& rest) noexcept {
  const ActiveSpan& span = active.span;
  for (int step = 0;; ++step) {
    rest = exact_rest(proxy);
    const glm::dvec3 free_rest = span.outside(rest);
    // Once there, only round-off is left, and to go on would stir it.
    if (step > 1 && glm::length(free_rest) <= tolerance_) return true;
    if (step == kMostSteps) return false;
    double missing[3] = {};
    for (int k = 0; k < span.count(); ++k) {
      const ActiveSet::Direction& h = active.directions[size_t(k)];
      missing[k] = h.plane ? -h.plane->exact_height : -glm::dot(h.along, h.line->exact_offset);
    }
    const SymmetricMatrix a = span.free_part(sliding_curvature());
    proxy += span.move(missing) - span.outside(solve(a, free_rest));
    ++exact_steps_;
  }
}

bool ConvexBalance::solve_active() noexcept {
  const ActiveSet active = active_set();
  glm::dvec3 proxy = proxy_ + proxy_low_, rest(0.0);
  if (!go_to_active(active, proxy, rest)) return false;

  // The forces that the active ones have to give for that. Where more are active than are
  // independent, their shares are not decided here: if it matters, the rounds must have come near
  // enough.
  double more[3] = {};
  active.span.shares(rest, more);
  for (int k = 0; k < active.span.count(); ++k) {
    const ActiveSet::Direction& h = active.directions[size_t(k)];
    if (active.repeats && shares_matter_ && !(std::abs(more[k]) * stiffness_ <= 0.1 * kResidualN))
      return false;
    if (h.plane)
      h.plane->exact_force += more[k];
    else
      h.line->exact_force += more[k] * h.along;
  }
  if (!all_can()) return false;
  rest = exact_rest(proxy);
  if (!(glm::length(rest) * stiffness_ <= 0.5 * kResidualN)) return false;
  rest_ = rest;
  proxy_ = proxy;
  proxy_low_ = glm::dvec3(0.0);
  for (size_t i = 0; i < plane_count_; ++i) planes_[i].force = planes_[i].exact_force;
  for (size_t i = 0; i < line_count_; ++i) lines_[i].force = lines_[i].exact_force;
  return true;
}

/// As solve_active(), with the active set of the last time, from where its forces would take the
/// proxy.
bool ConvexBalance::solve_active_of(const BalanceHint::Stage& hint) noexcept {
  if (hint.planes != int(plane_count_) || hint.lines != int(line_count_)) return false;

  // What is there now is kept, in case that the old active set fails.
  const glm::dvec3 before = proxy_;
  std::array<std::pair<double, bool>, PrimitiveSet::kCapacity> planes_before;
  std::array<std::pair<glm::dvec3, bool>, 2 * PrimitiveSet::kCapacity> lines_before;
  glm::dvec3 proxy = probe_;
  for (size_t i = 0; i < plane_count_; ++i) {
    Plane& plane = planes_[i];
    planes_before[i] = {plane.force, plane.active};
    plane.active = hint.plane_active[i];
    const bool all = !plane.active && hint.plane_n[i] > 0.0;
    plane.force = all ? plane.reach : std::min(hint.plane_n[i] / stiffness_, plane.reach);
    proxy += plane.force * plane.q;
  }
  for (size_t i = 0; i < line_count_; ++i) {
    lines_before[i] = {lines_[i].force, lines_[i].active};
    lines_[i].active = hint.line_active[i];
    lines_[i].force = hint.line_n[i] / stiffness_;
    proxy += lines_[i].force;
  }
  proxy_ = proxy;
  if (solve_active()) return true;
  proxy_ = before;
  for (size_t i = 0; i < plane_count_; ++i)
    std::tie(planes_[i].force, planes_[i].active) = planes_before[i];
  for (size_t i = 0; i < line_count_; ++i)
    std::tie(lines_[i].force, lines_[i].active) = lines_before[i];
  return false;
}

void ConvexBalance::remember(BalanceHint::Stage& hint) const noexcept {
  hint.planes = int(plane_count_);
  hint.lines = int(line_count_);
  for (size_t i = 0; i < plane_count_; ++i) {
    hint.plane_active[i] = planes_[i].active;
    hint.plane_n[i] = planes_[i].force * stiffness_;
  }
  for (size_t i = 0; i < line_count_; ++i) {
    hint.line_active[i] = lines_[i].active;
    hint.line_n[i] = lines_[i].force * stiffness_;
  }
}

}  // namespace palpate
