#include "module/haptics/guard/force_bridge.h"

#include "module/haptics/force_vector.h"
#include "module/haptics/guard/force_rates.h"

namespace palpate {
namespace {

// largest ratio of the hand's depth to the wall's radius of curvature
constexpr double kForceBend = 0.5;

glm::dvec3 towards_zero(glm::dvec3 v, double by) {
  const double length = glm::length(v);
  return length > by ? v * (1.0 - by / length) : glm::dvec3(0.0);
}

/// The part of a change of the force that a step of the hand relative to the material does not
/// explain. On a flat wall the force changes by k P step, where P projects on the directions that
/// the wall constrains: it lies in the ball that has 0 and k step as ends of a diameter. On a bent
/// wall it leaves that ball by at most depth / radius of the bend, for which the ball is enlarged
/// by a share of itself.
glm::dvec3 unexplained(glm::dvec3 change, glm::dvec3 step, double stiffness, double bend) {
  const glm::dvec3 centre = 0.5 * stiffness * step;
  return towards_zero(change - centre, (1.0 + bend) * glm::length(centre));
}

/// The part of a change that neither the hand nor the material explains; where the motion may not
/// be inverted only the hand does.
glm::dvec3 sudden_part(const ForceBridge::BridgeFrame& frame, glm::dvec3 change, bool rough,
                       bool slipped) {
  const double k = frame.stiffness_n_per_m;
  glm::dvec3 sudden = unexplained(change, -frame.step_m, k, rough ? 0.0 : kForceBend);
  for (const ForceBridge::MaterialStep& material : frame.materials) {
    const glm::dvec3 left = unexplained(change, material.carried_m - frame.step_m, k, kForceBend);
    if (!rough && glm::length(left) < glm::length(sudden)) sudden = left;
    // Of a surface that slips past for want of energy the proxy takes a part of the way.
    if (slipped) sudden = towards_zero(sudden, k * glm::length(material.carried_m));
  }
  return sudden;
}

}  // namespace

glm::dvec3 ForceBridge::fade(double dt_s) noexcept {
  return left_n_ = towards_zero(left_n_, kExchange_n_per_s * dt_s);
}

glm::dvec3 ForceBridge::step(const BridgeFrame& frame, EnergyTank* tank) noexcept {
  bool rough = false;
  for (const MaterialStep& material : frame.materials) rough |= material.is_rough;

  // The bridge of earlier frames continues; where it pushes the hand along its way that costs
  // energy.
  if (tank) tank->pay(frame.share * glm::dot(left_n_, frame.worked_m));
  const double rate_n_per_s = is_sudden_ ? kSudden_n_per_s : kExchange_n_per_s;
  left_n_ = towards_zero(left_n_, rate_n_per_s * frame.dt_s);

  // What the scene changes at once is added to the bridge, less what this frame lets through.
  const glm::dvec3 change = frame.spring_n + left_n_ - frame.felt_n;
  const glm::dvec3 sudden = sudden_part(frame, change, rough, tank && tank->slipped());
  const glm::dvec3 late =
      towards_zero(sudden, (rough ? kFade_n_per_s : kSudden_n_per_s) * frame.dt_s);
  left_n_ -= late;
  // The guards stop a force that is not finite; it must not stay in the bridge.
  if (!is_finite(left_n_)) left_n_ = glm::dvec3(0.0);
  is_sudden_ = late != glm::dvec3(0.0) || (is_sudden_ && left_n_ != glm::dvec3(0.0));
  is_rough_ = rough && late != glm::dvec3(0.0);

  // Paid for before the next tick, for it can not be taken back: a hand may go twice as far in it.
  // This is the one place where the scene's force may change by any amount in a tick, and the
  // guards' slew is what the hand feels: whatever would lead it more slowly would give it the same
  // energy.
  const double next_j = 2.0 * frame.share * glm::dot(left_n_, frame.worked_m);
  if (tank && next_j > tank->energy_j()) left_n_ *= tank->energy_j() / next_j;
  return left_n_;
}

}  // namespace palpate
