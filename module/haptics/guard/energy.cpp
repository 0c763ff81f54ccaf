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

// The largest s in [0, 1] with |from + s step|^2 <= |from|^2 - excess, or -1 if there is none,
// where s = 1 is known to be outside. a: |step|^2, half_b: from . step.
double furthest_inside(double a, double half_b, double excess) noexcept {
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

void EnergyTank::limit(std::span<SpringMove> springs, double stiffness_n_per_m,
                       double dt_s) noexcept {
  last_j_ = 0.0;
  slipped_ = false;
  const double k = stiffness_n_per_m, old_k = known_ ? last_stiffness_ : k;
  // Sums over all springs. Added energy at x = from + s: k/2 s.(s + 2 (from - probe)) for the way,
  // and what a stiffer spring and a turn put in at `from`. Written as differences: the energies
  // themselves may be much larger.
  double wanted_j = 0.0, raised_j = 0.0, sampling_j = 0.0;
  double squared_m2 = 0.0, step_m2 = 0.0, along_m2 = 0.0;
  bool finite = k > 0.0;
  for (size_t i = 0; i < springs.size(); ++i) {
    const SpringMove& s = springs[i];
    const glm::dvec3 from = s.from - s.probe, step = s.to - s.from, to = s.to - s.probe;
    if (known_) sampling_j += 0.5 * old_k * squared(s.probe - s.turned - last_probes_[i]);
    raised_j +=
        0.5 * (k - old_k) * squared(from) - 0.5 * old_k * glm::dot(s.turned, s.turned + 2.0 * from);
    wanted_j += 0.5 * k * glm::dot(step, from + to);
    squared_m2 += squared(from);
    step_m2 += squared(step);
    along_m2 += glm::dot(from, step);
    finite = finite && is_finite(from) && is_finite(step);
  }
  wanted_j += raised_j;
  if (!finite || !std::isfinite(wanted_j) || !std::isfinite(sampling_j)) {
    for (SpringMove& s : springs) s.to = s.from;
    return;
  }

  if (dt_s > 0.0 && std::isfinite(dt_s)) charge(options_.allowance_w * dt_s);
  for (size_t i = 0; i < springs.size(); ++i) last_probes_[i] = springs[i].probe;
  last_stiffness_ = k;
  if (wanted_j <= energy_j_) {
    book(wanted_j, sampling_j);
    return;
  }

  // The tank can pay for all x with k/2 |x - probe|^2 <= the spring's energy before + energy_j_: a
  // sphere about the probe (of all springs together). It holds `from`, unless a stiffer spring or a
  // turn alone costs more than the energy.
  const double excess = 2.0 * (raised_j - energy_j_) / k;  // |from - probe|^2 - its radius^2
  const double share = furthest_inside(step_m2, along_m2, excess);
  const double drawn =
      share < 0.0 ? std::sqrt(std::max(0.0, 1.0 - excess / squared_m2)) - 1.0 : 0.0;
  double joule = raised_j;
  for (SpringMove& s : springs) {
    const glm::dvec3 from = s.from - s.probe;
    s.to = s.from + (share < 0.0 ? drawn * from : share * (s.to - s.from));
    // What is booked is what was done: with x as rounded.
    const glm::dvec3 done = s.to - s.from;
    joule += 0.5 * k * glm::dot(done, done + 2.0 * from);
  }
  refused_.add(wanted_j - joule);
  slipped_ = true;
  ++slips_;
  book(joule, sampling_j);
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
