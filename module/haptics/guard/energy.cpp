#include "module/haptics/guard/energy.h"

#include <algorithm>
#include <cmath>

#include "module/haptics/force_vector.h"

namespace palpate {
namespace {

double from_zero_to(double v, double most) noexcept {
  return v > 0.0 ? std::min(v, most) : 0.0;  // NaN compares false
}

double squared(glm::dvec3 v) noexcept {
  return glm::dot(v, v);
}

// The largest a in [0, 1] with |from + a step|^2 <= |from|^2 - excess, or -1 if there is none,
// where a = 1 is known to be outside.
double furthest_inside(glm::dvec3 from, glm::dvec3 step, double excess) noexcept {
  const double a = squared(step), half_b = glm::dot(from, step);
  const double discriminant = half_b * half_b - a * excess;
  if (!(a > 0.0) || !(discriminant >= 0.0)) return -1.0;
  const double root = std::sqrt(discriminant);
  // Each root in the form that does not subtract nearly equal numbers.
  const double larger = half_b > 0.0 ? -excess / (half_b + root) : (root - half_b) / a;
  if (!(larger >= 0.0)) return -1.0;
  if (excess > 0.0 && excess / (root - half_b) > 1.0) return -1.0;  // comes in only beyond a = 1
  return std::min(larger, 1.0);
}

}  // namespace

void EnergyTank::CompensatedSum::add(double value) noexcept {
  const double sum = high + value;
  low += std::abs(high) >= std::abs(value) ? (high - sum) + value : (value - sum) + high;
  high = sum;
}

EnergyTank::EnergyTank(const EnergyTankOptions& options) noexcept {
  options_.capacity_j = from_zero_to(options.capacity_j, 1e3);
  options_.allowance_w = from_zero_to(options.allowance_w, 1e3);
  options_.dissipated_share = from_zero_to(options.dissipated_share, 1.0);
  energy_j_ = options_.capacity_j;
}

void EnergyTank::charge(double joule) noexcept {
  const double taken = std::min(joule, debt_j_ + options_.capacity_j - energy_j_);
  if (!(taken > 0.0)) return;
  charged_.add(taken);
  const double repaid = std::min(taken, debt_j_);
  debt_j_ -= repaid;
  energy_j_ = std::min(energy_j_ + (taken - repaid), options_.capacity_j);
}

void EnergyTank::book(double joule, double sampling_j) noexcept {
  last_j_ = joule;
  sampling_.add(sampling_j);
  if (joule > 0.0) {
    put_in_.add(joule);
    energy_j_ -= joule;
    if (energy_j_ < 0.0) {  // by rounding: booked, so that it does not add up over a day
      debt_j_ -= energy_j_;
      energy_j_ = 0.0;
    }
  } else {
    dissipated_.add(-joule);
    // Without the frame before it is not known what sampling made: nothing is charged.
    if (known_) charge(options_.dissipated_share * (-joule - sampling_j));
  }
  known_ = true;
}

void EnergyTank::pay(double joule) noexcept {
  if (!std::isfinite(joule)) return;
  if (joule <= 0.0) {
    dissipated_.add(-joule);
    return;
  }
  put_in_.add(joule);
  debt_j_ += std::max(0.0, joule - energy_j_);
  energy_j_ = std::max(0.0, energy_j_ - joule);
}

glm::dvec3 EnergyTank::limit(glm::dvec3 x_prev, glm::dvec3 x_new, glm::dvec3 probe,
                             double stiffness_n_per_m, double dt_s) noexcept {
  last_j_ = 0.0;
  slipped_ = false;
  const double k = stiffness_n_per_m;
  const glm::dvec3 from = x_prev - probe, step = x_new - x_prev, to = x_new - probe;
  const double old_k = known_ ? last_stiffness_ : k;
  const double sampling_j = known_ ? 0.5 * old_k * squared(probe - last_probe_) : 0.0;
  // Added energy at x = x_prev + s: k/2 s.(s + 2 from) for the way, and what a stiffer spring holds
  // at x_prev. Written as differences: the energies themselves may be much larger.
  const double stiffer_j = 0.5 * (k - old_k) * squared(from);
  const double wanted_j = 0.5 * k * glm::dot(step, from + to) + stiffer_j;
  if (!is_finite(from) || !is_finite(step) || !(k > 0.0) || !std::isfinite(wanted_j) ||
      !std::isfinite(sampling_j))
    return x_prev;

  if (dt_s > 0.0 && std::isfinite(dt_s)) charge(options_.allowance_w * dt_s);
  last_probe_ = probe;
  last_stiffness_ = k;
  if (wanted_j <= energy_j_) {
    book(wanted_j, sampling_j);
    return x_new;
  }

  // The tank can pay for all x with k/2 |x - probe|^2 <= old_k/2 |x_prev - probe|^2 + energy_j_: a
  // sphere about the probe. It holds x_prev, unless a stiffer spring alone costs more than the
  // energy.
  const double excess = 2.0 * (stiffer_j - energy_j_) / k;  // |x_prev - probe|^2 - its radius^2
  const double share = furthest_inside(from, step, excess);
  glm::dvec3 moved = share * step;
  if (share < 0.0) {
    const double inside = std::max(0.0, 1.0 - excess / squared(from));
    moved = (std::sqrt(inside) - 1.0) * from;
  }
  const glm::dvec3 x = x_prev + moved;
  // What is booked is what was done: with x as rounded.
  const glm::dvec3 done = x - x_prev;
  const double joule = 0.5 * k * glm::dot(done, done + 2.0 * from) + stiffer_j;
  refused_.add(wanted_j - joule);
  slipped_ = true;
  ++slips_;
  book(joule, sampling_j);
  return x;
}

EnergyLedger EnergyTank::ledger() const noexcept {
  EnergyLedger ledger;
  ledger.put_in_j = put_in_.value();
  ledger.dissipated_j = dissipated_.value();
  ledger.sampling_j = sampling_.value();
  ledger.refused_j = refused_.value();
  ledger.charged_j = charged_.value();
  ledger.slips = slips_;
  return ledger;
}

}  // namespace palpate
