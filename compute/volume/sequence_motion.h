#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "compute/volume/field.h"

namespace palpate {

/// The terms of a SequenceMotion that contribute at one time, with their weights: u = sum_n
/// weight[n] term[n].
struct TimeWeights {
  static constexpr int kMost = 41;  ///< c_0 and 20 harmonics
  int count = 0;
  std::array<int, kMost> term{};
  std::array<float, kMost> weight{};
};

/// How the terms of a SequenceMotion depend on time. Reads are real-time safe, any thread.
struct TimeBasis {
  std::vector<double> times_s;  ///< one per frame, rising, the first 0
  double cycle_s = 0.0;         ///< T, above the last time; 0: not cyclic
  /// H: terms are c_0, a_1, b_1, ... a_H, b_H of the cycle (cyclic only, at most kMostHarmonics).
  /// 0: one term per frame, and between them a cubic curve in time whose velocity does not jump at
  /// the frames (at each the slope of the parabola through it and its neighbours).
  int harmonics = 0;
  static constexpr int kMostHarmonics = (TimeWeights::kMost - 1) / 2;

  size_t terms() const { return harmonics > 0 ? size_t(2 * harmonics + 1) : times_s.size(); }
  /// At a time of the sequence; beyond its ends it wraps (cyclic) or is clamped.
  TimeWeights at(double time_s) const noexcept;
  /// At the share `phase` of the way from a frame to the next one.
  TimeWeights at(int frame, double phase) const noexcept;

 private:
  double step_s(int frame) const noexcept;  ///< from the frame to the next
};

/// One motion for a whole sequence: the material at X (LPS mm) in the reference frame is at X +
/// u(X, t) at time t. All frames are described from one frame, so errors do not add up over a
/// cycle: its drift is zero by construction, while fields from frame to frame drift. At the
/// reference frame's time u is zero up to rounding and the error of the harmonics.
///
/// Cyclic data have u as harmonics of the cycle,
///   u(X, t) = c_0(X) + sum_h [a_h(X) cos(2 pi h t / T) + b_h(X) sin(2 pi h t / T)],
/// smooth in time and periodic. Without harmonics u is known at the frames and is a smooth curve
/// between them.
struct SequenceMotion {
  /// the frame from which all others are described; the one nearest to the mean
  size_t reference = 0;
  TimeBasis basis;
  std::vector<Field> terms;  ///< basis.terms() of them, mm, LPS, on one grid
  /// of the frames whose motion it is, which mostly is finer than that of the terms; empty: not
  /// known
  std::optional<Grid> frames_grid = {};

  size_t frames() const { return basis.times_s.size(); }
  /// u(., t). Allocates; any thread.
  Field at(double time_s) const;
  /// u at frame k.
  Field at_frame(size_t k) const { return at(basis.times_s[k]); }
};

/// The length of a cycle for frame times that do not contain it: the last frame leads back to the
/// first after the median step, which a missing frame does not change. Needs at least two times.
double cycle_of(std::span<const double> times_s);

/// sum_n weights[n] fields[n]; at least one field, all on one grid.
Field combined(const std::vector<Field>& fields, const TimeWeights& weights);

}  // namespace palpate
