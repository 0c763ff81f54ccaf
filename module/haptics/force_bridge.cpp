#include "module/haptics/force_bridge.h"

#include "module/haptics/force_rates.h"
#include "module/haptics/force_vector.h"

namespace palpate {
namespace {

constexpr double kBend = 0.5;     // of the hand's depth by the radius of the wall's bend
constexpr double kSaid_n = 0.05;  // less than this on its way to the hand is not worth a word

glm::dvec3 towards_zero(glm::dvec3 v, double by) {
  const double length = glm::length(v);
  return length > by ? v * (1.0 - by / length) : glm::dvec3(0.0);
}

/// By how much a change of the force is more than a step of the hand relative to the material
/// explains. On a flat wall the force changes by k P step, where P projects on what the wall holds:
/// it lies in the ball that has 0 and k step as ends of a diameter. On a bent wall it leaves that
/// ball by at most depth / radius of the bend, for which the ball is enlarged by a share of itself.
glm::dvec3 unexplained(glm::dvec3 change, glm::dvec3 step, double stiffness, double bend) {
  const glm::dvec3 centre = 0.5 * stiffness * step;
  return towards_zero(change - centre, (1.0 + bend) * glm::length(centre));
}

/// The part of a change that neither the hand nor the material explains; where the motion may not
/// be inverted only the hand does.
glm::dvec3 sudden_part(const ForceBridge::Frame& frame, glm::dvec3 change, bool rough,
                       bool slipped) {
  const double k = frame.stiffness_n_per_m;
  glm::dvec3 sudden = unexplained(change, -frame.step_m, k, rough ? 0.0 : kBend);
  for (const CarrierRun& run : frame.carriers) {
    const glm::dvec3 left = unexplained(change, run.carried_m - frame.step_m, k, kBend);
    if (!rough && glm::length(left) < glm::length(sudden)) sudden = left;
    // Of a surface that slips past for want of energy the proxy takes a part of the way.
    if (slipped) sudden = towards_zero(sudden, k * glm::length(run.carried_m));
  }
  return sudden;
}

}  // namespace

glm::dvec3 ForceBridge::fade(double dt_s) noexcept {
  return left_n_ = towards_zero(left_n_, kExchange_n_per_s * dt_s);
}

glm::dvec3 ForceBridge::step(const Frame& frame, EnergyTank* tank) noexcept {
  bool rough = false;
  for (const CarrierRun& run : frame.carriers) rough |= run.carrier->report().rough || run.held;

  // What was bridged before goes on; where it pushes the hand on its way that costs energy.
  if (tank) tank->pay(glm::dot(left_n_, frame.step_m));
  const double rate_n_per_s = is_sudden_ ? kSudden_n_per_s : kExchange_n_per_s;
  left_n_ = towards_zero(left_n_, rate_n_per_s * frame.dt_s);

  // What the scene changes at once is put off, but for what the hand is led by in this frame.
  const glm::dvec3 change = frame.spring_n + left_n_ - frame.felt_n;
  const glm::dvec3 sudden = sudden_part(frame, change, rough, tank && tank->slipped());
  const glm::dvec3 late =
      towards_zero(sudden, (rough ? kFade_n_per_s : kSudden_n_per_s) * frame.dt_s);
  left_n_ -= late;
  // A force that is not finite is the guards' to stop; it must not stay in here.
  if (!is_finite(left_n_)) left_n_ = glm::dvec3(0.0);
  is_sudden_ = late != glm::dvec3(0.0) || (is_sudden_ && left_n_ != glm::dvec3(0.0));
  is_rough_ = rough && late != glm::dvec3(0.0);

  // Paid for before the next tick, for it can not be taken back: a hand may go twice as far in it.
  // This is the one place where the scene's force may change by any amount in a tick, and the
  // guards' slew is what the hand feels: whatever would lead it more slowly would give it the same
  // energy.
  const double next_j = 2.0 * glm::dot(left_n_, frame.step_m);
  if (tank && next_j > tank->energy_j()) left_n_ *= tank->energy_j() / next_j;
  return left_n_;
}

bool ForceBridge::is_felt() const noexcept {
  return is_sudden_ && glm::length(left_n_) > kSaid_n;
}

}  // namespace palpate
