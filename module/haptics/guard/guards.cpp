#include "module/haptics/guard/guards.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {
namespace {

constexpr double kWarm = 0.8;          // of the final heat: from here on the force is lowered
constexpr double kSpent = 0.5;         // of the budget: from here on the gain falls
constexpr double kForgiveS = 0.1;      // of what a contact owes, from when it is as old as this
constexpr double kNewContactS = 0.02;  // apart for so long: the next touch is a new contact

}  // namespace

MotorHeat::MotorHeat(double continuous_n, double most_n, double time_constant_s) noexcept
    : continuous_n_(std::min(continuous_n, most_n)),
      most_n_(most_n),
      time_constant_s_(time_constant_s) {}

void MotorHeat::step(double force_n, double dt_s) noexcept {
  const double ratio = force_n / continuous_n_;
  // Implicit Euler: stable for any dt, and the fixed point is the exact one.
  const double share = dt_s / (time_constant_s_ + dt_s);
  heat_ += share * (ratio * ratio - heat_);
}

double MotorHeat::limit_n() const noexcept {
  const double cool = std::clamp((1.0 - heat_) / (1.0 - kWarm), 0.0, 1.0);
  return continuous_n_ + (most_n_ - continuous_n_) * cool;
}

PowerGate::PowerGate(double power_w, double budget_j, double gain_per_s) noexcept
    : power_w_(power_w), budget_j_(budget_j), gain_per_s_(gain_per_s), left_j_(budget_j) {}

void PowerGate::step(double work_j, double dt_s) noexcept {
  // Overdrawn by no more than the budget: a wrong position must not close the gate for an hour.
  left_j_ = std::clamp(left_j_ + power_w_ * dt_s - work_j, -budget_j_, budget_j_);
  const double wanted = std::clamp(left_j_ / (kSpent * budget_j_), 0.0, 1.0);
  const double most = gain_per_s_ * dt_s;
  gain_ += std::clamp(wanted - gain_, -most, most);
}

FirstContact::FirstContact(double young_n_per_s, double young_s) noexcept
    : young_n_per_s_(young_n_per_s), young_s_(young_s) {}

void FirstContact::step(bool touching, double dt_s) noexcept {
  if (touching && apart_s_ >= kNewContactS)
    age_s_ = 0.0;
  else
    age_s_ = std::min(age_s_ + dt_s, 1e3);
  apart_s_ = touching ? 0.0 : std::min(apart_s_ + dt_s, 1.0);
}

double FirstContact::slew_n_per_s(double full_n_per_s) const noexcept {
  if (apart_s_ >= kNewContactS) return full_n_per_s;  // nothing is touched: no contact is young
  const double grown = young_s_ > 0.0 ? std::clamp(age_s_ / young_s_ - 1.0, 0.0, 1.0) : 1.0;
  const double young = std::min(young_n_per_s_, full_n_per_s);
  return young + (full_n_per_s - young) * grown;
}

void PassiveReturn::move(double wanted_j, double given_j) noexcept {
  owed_j_ = std::max(0.0, owed_j_ + wanted_j - given_j);
  out_j_ = std::max(0.0, -wanted_j);
}

double PassiveReturn::most_n(double spring_n, double wanted_n, double stiffness_n_per_m,
                             double dt_s) noexcept {
  // Free, or nothing that stores energy.
  if (!(wanted_n > 0.0 && stiffness_n_per_m > 0.0)) {
    *this = PassiveReturn(rate_n_per_s_);
    return std::numeric_limits<double>::infinity();
  }
  // What the spring gives back on the hand's way out of it, with its force limited to wanted_n.
  const double stored_j =
      wanted_n * (std::max(spring_n, wanted_n) - 0.5 * wanted_n) / stiffness_n_per_m;
  owed_j_ = std::min(owed_j_, stored_j);
  const bool withdraws = out_j_ > 0.0 && wanted_n_ > 0.0;
  age_s_ += dt_s;
  if (age_s_ > kForgiveS) owed_j_ *= kForgiveS / (kForgiveS + dt_s);
  const double target = withdraws ? 1.0 - owed_j_ / stored_j : 1.0;
  const double felt = std::min(given_, share_);
  if (target < felt)
    share_ = std::max(target, felt - stiffness_n_per_m * out_j_ / (wanted_n_ * wanted_n));
  else
    share_ = std::min(target, share_ + rate_n_per_s_ * dt_s / wanted_n);
  wanted_n_ = wanted_n;
  return share_ < 1.0 ? share_ * wanted_n : std::numeric_limits<double>::infinity();
}

void PassiveReturn::give(double given_n) noexcept {
  given_ = wanted_n_ > 0.0 ? std::min(1.0, given_n / wanted_n_) : 1.0;
}

}  // namespace palpate
