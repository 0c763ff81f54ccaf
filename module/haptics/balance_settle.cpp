#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "module/haptics/balance_convex.h"

namespace palpate {
namespace {

// A constraint that leaves the span of the others by less than this sine is taken to be within it.
constexpr double kWithin = 1e-3;
constexpr int kMostSteps = 8;

/// Up to three directions that are held, made orthogonal one after the other.
template <class Real>
class HeldSpan {
 public:
  using Vec = glm::vec<3, Real>;

  /// False if it lies within the span already.
  bool add(Vec normal) noexcept {
    Vec rest = normal;
    for (int k = 0; k < count_; ++k) rest -= base_[k] * glm::dot(base_[k], rest);
    const Real length = glm::length(rest);
    if (count_ == 3 || length < Real(kWithin)) return false;
    normals_[count_] = normal;
    base_[count_++] = rest / length;
    return true;
  }
  int count() const noexcept { return count_; }
  Vec outside(Vec v) const noexcept {
    for (int k = 0; k < count_; ++k) v -= base_[k] * glm::dot(base_[k], v);
    return v;
  }
  /// A symmetric matrix along what is free only; the identity along the span.
  template <class Matrix>
  Matrix free_part(const Matrix& a) const noexcept {
    Vec rows[3] = {outside({a.xx, a.xy, a.xz}), outside({a.xy, a.yy, a.yz}),
                   outside({a.xz, a.yz, a.zz})};
    Vec columns[3];
    for (int c = 0; c < 3; ++c) columns[c] = outside({rows[0][c], rows[1][c], rows[2][c]});
    Matrix free{columns[0].x, columns[1].x, columns[2].x, columns[1].y, columns[2].y, columns[2].z};
    for (int k = 0; k < count_; ++k) {
      const Vec b = base_[k];
      free.xx += b.x * b.x, free.xy += b.x * b.y, free.xz += b.x * b.z;
      free.yy += b.y * b.y, free.yz += b.y * b.z, free.zz += b.z * b.z;
    }
    return free;
  }

  /// The least move that changes the heights over the normals by so much.
  Vec move(const Real (&heights)[3]) const noexcept {
    // base_k . x, one after the other: normal_k = its part along earlier bases and along its own.
    Vec x(Real(0));
    for (int k = 0; k < count_; ++k) {
      const Real missing = heights[k] - glm::dot(normals_[k], x);
      x += base_[k] * (missing / glm::dot(normals_[k], base_[k]));
    }
    return x;
  }
  /// Shares of the normals that add up to the part of v within the span.
  void shares(Vec v, Real (&out)[3]) const noexcept {
    for (int k = count_ - 1; k >= 0; --k) {
      out[k] = glm::dot(v, base_[k]) / glm::dot(normals_[k], base_[k]);
      v -= out[k] * normals_[k];
    }
  }

 private:
  Vec normals_[3], base_[3];
  int count_ = 0;
};

/// Two directions at right angles to a line; all three axes for a point.
template <class Real>
int across(glm::vec<3, Real> q, glm::vec<3, Real> (&out)[3]) noexcept {
  using Vec = glm::vec<3, Real>;
  if (q == Vec(Real(0))) {
    out[0] = Vec(1, 0, 0), out[1] = Vec(0, 1, 0), out[2] = Vec(0, 0, 1);
    return 3;
  }
  const Vec axis = std::abs(q.x) < Real(0.6) ? Vec(1, 0, 0) : Vec(0, 1, 0);
  out[0] = glm::normalize(glm::cross(q, axis));
  out[1] = glm::cross(q, out[0]);
  return 2;
}

}  // namespace

/// Everything where the proxy would be: offsets, and spring less forces.
template <class Real>
auto ConvexBalance<Real>::settled_rest(Vec proxy) noexcept -> Vec {
  Vec rest = proxy - probe_;
  for (size_t i = 0; i < plane_count_; ++i) {
    Plane& plane = planes_[i];
    plane.settled_height = glm::dot(plane.q, proxy - plane.position);
    rest -= plane.settled_force * plane.q;
  }
  for (size_t i = 0; i < line_count_; ++i) {
    Line& line = lines_[i];
    // Twice: far along a line, what rounding leaves of that is not small beside a short offset.
    Vec offset = proxy - line.position;
    offset -= line.q * glm::dot(line.q, offset);
    line.settled_offset = offset - line.q * glm::dot(line.q, offset);
    const Real length = glm::length(line.settled_offset);
    // What slides is pulled back along its offset.
    if (!line.held && length > Real(0))
      line.settled_force = line.settled_offset * (-line.reach / length);
    rest -= line.settled_force;
  }
  return rest;
}

/// How the spring and the forces of what slides change with the proxy.
template <class Real>
auto ConvexBalance<Real>::sliding_curvature() const noexcept -> Matrix {
  Matrix a{1.0, 0.0, 0.0, 1.0, 0.0, 1.0};
  for (size_t i = 0; i < line_count_; ++i) {
    const Line& line = lines_[i];
    const Real length = glm::length(line.settled_offset);
    if (line.held || !(length > Real(0))) continue;
    const Real c = line.reach / length;
    const Vec o = line.settled_offset / length, q = line.q;
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
template <class Real>
bool ConvexBalance<Real>::all_can() const noexcept {
  for (size_t i = 0; i < plane_count_; ++i) {
    const Plane& plane = planes_[i];
    const Real height = plane.settled_height, force = plane.settled_force;
    const bool can =
        plane.held ? std::abs(height) <= plane.slack && force >= Real(0) && force <= plane.reach
        : force > Real(0) ? height <= plane.slack
                          : height >= -plane.slack;
    if (!can) return false;
  }
  for (size_t i = 0; i < line_count_; ++i) {
    const Line& line = lines_[i];
    const Real square = glm::dot(line.settled_offset, line.settled_offset);
    const Real force = glm::dot(line.settled_force, line.settled_force);
    const bool can = line.held
                         ? square <= line.slack * line.slack && force <= line.reach * line.reach
                         : square > line.slack * line.slack;
    if (!can) return false;
  }
  return true;
}

template <class Real>
bool ConvexBalance<Real>::settle() noexcept {
  struct Held {
    Plane* plane;
    Line* line;
    Vec along;
  };
  HeldSpan<Real> span;
  std::array<Held, 3> held{};
  bool repeats = false;
  const auto hold = [&](Plane* plane, Line* line, Vec along) {
    const auto at = size_t(span.count());
    if (span.add(along))
      held[at] = {plane, line, along};
    else
      repeats = true;
  };
  for (size_t i = 0; i < plane_count_; ++i) {
    planes_[i].settled_force = planes_[i].force;
    if (planes_[i].held) hold(&planes_[i], nullptr, planes_[i].q);
  }
  for (size_t i = 0; i < line_count_; ++i) {
    lines_[i].settled_force = lines_[i].force;
    if (!lines_[i].held) continue;
    Vec axes[3];
    const int count = across(lines_[i].q, axes);
    for (int a = 0; a < count; ++a) hold(nullptr, &lines_[i], axes[a]);
  }

  // To where they hold exactly, and along what is left free to where spring and forces balance.
  Vec proxy = proxy_ + proxy_low_, rest(Real(0));
  for (int step = 0;; ++step) {
    rest = settled_rest(proxy);
    const Vec free_rest = span.outside(rest);
    // Once there, only round-off is left, and to go on would stir it.
    if (step > 1 && glm::length(free_rest) <= tolerance_) break;
    if (step == kMostSteps) return false;
    Real missing[3] = {};
    for (int k = 0; k < span.count(); ++k) {
      const Held& h = held[size_t(k)];
      missing[k] = h.plane ? -h.plane->settled_height : -glm::dot(h.along, h.line->settled_offset);
    }
    const Matrix a = span.free_part(sliding_curvature());
    proxy += span.move(missing) - span.outside(solve(a, free_rest));
    ++settle_steps_;
  }

  // What the held ones have to give for that. Where more are held than are independent, who gives
  // how much is not settled here: if it matters, the rounds must have come near enough.
  Real more[3] = {};
  span.shares(rest, more);
  for (int k = 0; k < span.count(); ++k) {
    Held& h = held[size_t(k)];
    if (repeats && shares_matter_ && !(std::abs(more[k]) * stiffness_ <= Real(0.1 * kResidualN)))
      return false;
    if (h.plane)
      h.plane->settled_force += more[k];
    else
      h.line->settled_force += more[k] * h.along;
  }
  if (!all_can()) return false;
  rest = settled_rest(proxy);
  if (!(glm::length(rest) * stiffness_ <= Real(0.5 * kResidualN))) return false;
  rest_ = rest;
  proxy_ = proxy;
  proxy_low_ = Vec(Real(0));
  for (size_t i = 0; i < plane_count_; ++i) planes_[i].force = planes_[i].settled_force;
  for (size_t i = 0; i < line_count_; ++i) lines_[i].force = lines_[i].settled_force;
  return true;
}

/// As settle(), with what held the last time, from where those forces would take the proxy.
template <class Real>
bool ConvexBalance<Real>::settle_as(const BalanceHint::Stage& hint) noexcept {
  if (hint.planes != int(plane_count_) || hint.lines != int(line_count_)) return false;
  const Vec before = proxy_;
  std::array<std::pair<Real, bool>, PrimitiveSet::kCapacity> planes_before;
  std::array<std::pair<Vec, bool>, 2 * PrimitiveSet::kCapacity> lines_before;
  Vec proxy = probe_;
  for (size_t i = 0; i < plane_count_; ++i) {
    Plane& plane = planes_[i];
    planes_before[i] = {plane.force, plane.held};
    plane.held = hint.plane_holds[i];
    const bool all = !plane.held && hint.plane_n[i] > 0.0;
    plane.force = all ? plane.reach : std::min<Real>(hint.plane_n[i] / stiffness_, plane.reach);
    proxy += plane.force * plane.q;
  }
  for (size_t i = 0; i < line_count_; ++i) {
    lines_before[i] = {lines_[i].force, lines_[i].held};
    lines_[i].held = hint.line_holds[i];
    lines_[i].force = Vec(hint.line_n[i]) / stiffness_;
    proxy += lines_[i].force;
  }
  proxy_ = proxy;
  if (settle()) return true;
  proxy_ = before;
  for (size_t i = 0; i < plane_count_; ++i)
    std::tie(planes_[i].force, planes_[i].held) = planes_before[i];
  for (size_t i = 0; i < line_count_; ++i)
    std::tie(lines_[i].force, lines_[i].held) = lines_before[i];
  return false;
}

template <class Real>
void ConvexBalance<Real>::remember(BalanceHint::Stage& hint) const noexcept {
  hint.planes = int(plane_count_);
  hint.lines = int(line_count_);
  for (size_t i = 0; i < plane_count_; ++i) {
    hint.plane_holds[i] = planes_[i].held;
    hint.plane_n[i] = double(planes_[i].force * stiffness_);
  }
  for (size_t i = 0; i < line_count_; ++i) {
    hint.line_holds[i] = lines_[i].held;
    hint.line_n[i] = glm::dvec3(lines_[i].force * stiffness_);
  }
}

// The class is instantiated where the rounds are; these members are here.
template auto ConvexBalance<double>::settled_rest(Vec) noexcept -> Vec;
template auto ConvexBalance<double>::sliding_curvature() const noexcept -> Matrix;
template bool ConvexBalance<double>::all_can() const noexcept;
template bool ConvexBalance<double>::settle() noexcept;
template bool ConvexBalance<double>::settle_as(const BalanceHint::Stage&) noexcept;
template void ConvexBalance<double>::remember(BalanceHint::Stage&) const noexcept;
template auto ConvexBalance<long double>::settled_rest(Vec) noexcept -> Vec;
template auto ConvexBalance<long double>::sliding_curvature() const noexcept -> Matrix;
template bool ConvexBalance<long double>::all_can() const noexcept;
template bool ConvexBalance<long double>::settle() noexcept;
template bool ConvexBalance<long double>::settle_as(const BalanceHint::Stage&) noexcept;
template void ConvexBalance<long double>::remember(BalanceHint::Stage&) const noexcept;

}  // namespace palpate
