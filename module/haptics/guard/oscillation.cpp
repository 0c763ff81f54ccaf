#include "module/haptics/guard/oscillation.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr double kTwoPi = 6.283185307179586;
constexpr double kHighPassS = 1.0 / (kTwoPi * 20.0), kLowPassS = 1.0 / (kTwoPi * 300.0);
constexpr double kMeanS = 0.05;               // of the power and of the axis
constexpr double kLongestWaveS = 1.0 / 30.0;  // half a period at 15 Hz
// A half wave against the one before it on its own side and on the other side. A force that can
// only push (a wall) makes sides of unlike size; what decays by more than this is a touch.
constexpr double kAlike = 0.6, kOpposite = 0.35;
// No hand makes a half wave as quick as this. It is only a few samples wide, so its size varies.
constexpr double kQuickS = 0.005, kQuickAlike = 0.2;
constexpr int kRow = 6;          // half waves: three periods
constexpr double kLowest = 0.2;  // gain
constexpr double kFallPerS = 7.0, kRisePerS = 0.2;
constexpr double kBelow = 0.7, kForgetPerS = 0.02;  // how far below, and for how long
// What the hand's motion explains of the force, as a share of its rms, where the loop shakes.
constexpr double kHandsShare = 0.5;
constexpr double kTripS = 0.2;  // of buzzing at the lowest gain

}  // namespace

OscillationGuard::OscillationGuard(double buzz_n) noexcept : buzz_n_(buzz_n) {}

double OscillationGuard::rms_n() const noexcept {
  return std::sqrt(power_);
}

void OscillationGuard::Band::step(glm::dvec3 value, double dt_s) noexcept {
  const double keep = kHighPassS / (kHighPassS + dt_s), take = dt_s / (kLowPassS + dt_s);
  const glm::dvec3 before = high1;
  high1 = keep * (high1 + value - last);
  high2 = keep * (high2 + high1 - before);
  band += take * (high2 - band);
  last = value;
}

void OscillationGuard::step(glm::dvec3 force_n, glm::dvec3 hand_n, double dt_s) noexcept {
  if (!heard_) {
    force_.last = force_n;
    hand_.last = hand_n;
  }
  heard_ = true;
  force_.step(force_n, dt_s);
  hand_.step(hand_n, dt_s);

  const glm::dvec3& band = force_.band;
  const double forget = dt_s / (kMeanS + dt_s);
  power_ += forget * (glm::dot(band, band) - power_);
  hand_power_ += forget * (glm::dot(hand_.band, hand_.band) - hand_power_);
  // The axis: the mean of the band's force with its sign turned to the axis' side.
  axis_ += forget * ((glm::dot(band, axis_) < 0.0 ? -band : band) - axis_);
  const double length = glm::length(axis_);
  hear(length > 1e-9 ? glm::dot(band, axis_) / length : 0.0, dt_s);
  ramp_gain(dt_s);
  if (buzzing_) is_scenes_ = hand_power_ < kHandsShare * kHandsShare * power_;
}

void OscillationGuard::hear(double along_axis, double dt_s) noexcept {
  const double least = 0.5 * buzz_n_;  // a sine of buzz_n rms peaks at 1.41 of it
  wave_s_ += dt_s;
  if (along_axis * wave_sign_ < -0.5 * least) {
    const bool quick = wave_s_ <= kQuickS;
    const double like = quick ? kQuickAlike : kAlike, unlike = quick ? kQuickAlike : kOpposite;
    const bool alike = wave_peak_ >= least && wave_s_ <= kLongestWaveS &&
                       wave_peak_ >= std::max(like * last_but_one_peak_, unlike * last_peak_);
    row_ = alike ? std::min(row_ + 1, kRow) : 0;
    last_but_one_peak_ = last_peak_;
    last_peak_ = wave_peak_;
    wave_sign_ = -wave_sign_;
    wave_peak_ = 0.0;
    wave_s_ = 0.0;
  } else if (wave_s_ > kLongestWaveS) {
    row_ = 0;
    last_peak_ = last_but_one_peak_ = 0.0;
  }
  wave_peak_ = std::max(wave_peak_, along_axis * wave_sign_);
}

void OscillationGuard::ramp_gain(double dt_s) noexcept {
  const double rms = rms_n();
  const bool before = buzzing_;
  buzzing_ = row_ == kRow && rms > (buzzing_ ? 0.5 : 1.0) * buzz_n_;
  if (!buzzing_) {
    ceiling_ = std::min(1.0, ceiling_ + kForgetPerS * dt_s);
    if (gain_ < ceiling_) gain_ = std::min(ceiling_, gain_ + kRisePerS * dt_s);
    lowest_s_ = 0.0;
    return;
  }
  // Coming back to where it began would only begin it again.
  if (!before) ceiling_ = std::max(kLowest, kBelow * gain_);
  gain_ = std::max(kLowest, gain_ - kFallPerS * dt_s);
  // What is left at the lowest gain must be a buzz by the upper threshold too.
  lowest_s_ = gain_ > kLowest || rms <= buzz_n_ ? 0.0 : lowest_s_ + dt_s;
  if (lowest_s_ > kTripS) tripped_ = true;
}

}  // namespace palpate
