#include "module/haptics/proxy/balance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "module/haptics/proxy/balance_convex.h"

namespace palpate {
namespace {

using Kind = Primitive::Kind;

/// What planes and lines through one point along one direction, or points at one place, add up to.
struct AddedPrimitives {
  glm::dvec3 position{0.0}, q{0.0};
  double up_n = 0.0, down_n = 0.0;                    // planes along q and along -q
  double up_friction_n = 0.0, down_friction_n = 0.0;  // their strengths times their friction
  double around_n = 0.0;                              // lines, or points with q = 0
};

/// False if the primitive is not of the same column.
bool add(AddedPrimitives& column, const Primitive& p) noexcept {
  if (p.position != column.position) return false;
  if (p.kind == Kind::kPoint) {
    column.around_n += p.strength_n;
    return column.q == glm::dvec3(0.0);
  }
  const bool up = p.direction == column.q;
  if (!up && p.direction != -column.q) return false;
  if (p.kind == Kind::kLine) {
    column.around_n += p.strength_n;
  } else {
    (up ? column.up_n : column.down_n) += p.strength_n;
    (up ? column.up_friction_n : column.down_friction_n) += p.friction * p.strength_n;
  }
  return true;
}

/// Normal and tangential part are separate problems; friction takes the normal one's force, shared
/// by planes in proportion to strength.
glm::dvec3 proxy_of(const AddedPrimitives& column, glm::dvec3 probe,
                    double stiffness_n_per_m) noexcept {
  const glm::dvec3 g = probe - column.position;
  const double normal = glm::dot(g, column.q);
  const glm::dvec3 tangential = g - normal * column.q;
  const bool behind = normal < 0.0;
  const double wanted_n = std::abs(normal) * stiffness_n_per_m;
  const double strength_n = behind ? column.up_n : column.down_n;
  const double normal_n = std::min(wanted_n, strength_n);
  double around_n = column.around_n;
  if (normal_n > 0.0)
    around_n += (behind ? column.up_friction_n : column.down_friction_n) * (normal_n / strength_n);
  if (normal_n == 0.0 && around_n == 0.0) return probe;  // to the last bit

  glm::dvec3 proxy = column.position;
  if (wanted_n > strength_n) proxy += (1.0 - strength_n / wanted_n) * normal * column.q;
  const double tangential_n = glm::length(tangential) * stiffness_n_per_m;
  if (tangential_n > around_n) proxy += (1.0 - around_n / tangential_n) * tangential;
  return proxy;
}

/// Equation (12): the friction of each plane from the normal forces of a solve without friction.
Balance convex_balance(const PrimitiveSet& primitives, glm::dvec3 probe, double stiffness_n_per_m,
                       BalanceHint* hint) noexcept {
  ConvexBalance convex(probe, stiffness_n_per_m);
  bool friction = false;
  for (const Primitive& p : primitives) {
    if (p.kind == Kind::kPlane) convex.add_plane(p.position, p.direction, p.strength_n);
    if (p.kind == Kind::kLine) convex.add_line(p.position, p.direction, p.strength_n);
    if (p.kind == Kind::kPoint) convex.add_point(p.position, p.strength_n);
    friction = friction || (p.kind == Kind::kPlane && p.friction > 0.0);
  }
  Balance result = convex.solve(friction, hint ? &hint->without_friction : nullptr);
  if (!friction) return result;
  int plane = 0;
  bool rubs = false;
  for (const Primitive& p : primitives) {
    if (p.kind != Kind::kPlane) continue;
    const double strength_n = p.friction * convex.plane_force_n(plane++);
    if (!(strength_n > 0.0)) continue;
    convex.add_line(p.position, p.direction, strength_n);
    rubs = true;
  }
  if (!rubs) return result;
  const int iterations = result.iterations;
  result = convex.solve(false, hint ? &hint->with_friction : nullptr);
  result.iterations += iterations;
  return result;
}

}  // namespace

Balance balance(const PrimitiveSet& primitives, glm::dvec3 probe, double stiffness_n_per_m,
                BalanceHint* hint) noexcept {
  AddedPrimitives column;
  bool empty = true, one_column = true;
  glm::dvec3 pull_n(0.0);
  for (const Primitive& p : primitives) {
    if (p.kind == Kind::kForce) {
      pull_n += p.strength_n * p.direction;
      continue;
    }
    if (empty) {
      column.position = p.position;
      if (p.kind != Kind::kPoint) column.q = p.direction;
      empty = false;
    }
    one_column = one_column && add(column, p);
  }
  const glm::dvec3 pulled = probe + pull_n / stiffness_n_per_m;
  Balance result;
  if (empty)
    result.proxy = pulled;
  else if (one_column)
    result.proxy = proxy_of(column, pulled, stiffness_n_per_m);
  else
    result = convex_balance(primitives, pulled, stiffness_n_per_m, hint);
  // Numbers too large for doubles: the spring is let go, and that is said.
  if (!std::isfinite(result.proxy.x + result.proxy.y + result.proxy.z)) {
    result.proxy = probe;
    result.residual_n = std::numeric_limits<double>::infinity();
    result.converged = false;
  }
  return result;
}

}  // namespace palpate
