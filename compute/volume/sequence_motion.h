#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "compute/volume/field.h"

namespace palpate {

/// The summands of a SequenceMotion that contribute at one time, with their weights: u = sum_n
/// weight[n] summand[term[n]].
struct TimeWeights {
  static constexpr int kMost = 41;  ///< c_0 and 20 harmonics
  int count = 0;
  std::array<int, kMost> term{};
  std::array<float, kMost> weight{};
};

/// How a SequenceMotion depends on time: u(X, t) = U(X, s(t)). The path U of the material is that
/// of frames at even times; the times of the frames decide only when it is where. This is the one
/// definition: the hand, the picture, files and measures all sum what at() says.
///
/// The clock s counts frames, s(t_k) = k. At the share p of the step from frame k, of length h_k,
///   s = k + p + ahead(p, e(h_k, h_{k-1})) - ahead(1 - p, e(h_k, h_{k+1})),
///   ahead(p, e) = e p (1 - p / w)^2 for p < w, else 0,   w = min(1, 0.2 / |e|),
///   e(h, h') = (h - h') / (h + h'); 0 at an end that has no neighbour.
/// So its rate at frame k is 2 / (h_{k-1} + h_k) from both sides (no velocity jumps), it always
/// rises, it is at most 0.05 frames away from k + p, and it does not change if all times are
/// multiplied. Even times: s = t / h.
///
/// Without harmonics U is a cubic curve through the frames' fields u_k, with slopes m_k per frame
/// (d_k = u_{k+1} - u_k),
///   U(k + q) = (1 + 2q) (1 - q)^2 u_k + q (1 - q)^2 m_k
///              + q^2 (3 - 2q) u_{k+1} - q^2 (1 - q) m_{k+1},
///   m_k = (d_{k-1} + d_k) / 2; at an end, that of the only step.
/// Each component of m_k is limited to 3 (|d| + turn) of both steps beside it; turn is the smaller
/// one of the two steps around d if they have opposite signs, else 0. So a component that rises or
/// falls from frame to frame does so between them (Fritsch and Carlson 1980), and one that turns
/// between two frames may do so.
///
/// With H harmonics of a cycle of N frames
///   U(s) = c_0 + sum_h [a_h cos(2 pi h s / N) + b_h sin(2 pi h s / N)].
///
/// Reads are real-time safe, any thread.
struct TimeBasis {
  std::vector<double> times_s;  ///< one per frame, rising, the first 0
  double cycle_s = 0.0;         ///< T, above the last time; 0: not cyclic
  /// H (cyclic only, at most kMostHarmonics): the terms are c_0, a_1, b_1, ... a_H, b_H. 0: a term
  /// per frame, its field.
  int harmonics = 0;
  /// The last frame is the first once more (cyclic only): it has a term and a time, but the path is
  /// that through the N frames before it, and its last step leads to the first at cycle_s.
  bool repeats_first = false;
  static constexpr int kMostHarmonics = (TimeWeights::kMost - 1) / 2;

  size_t terms() const { return harmonics > 0 ? size_t(2 * harmonics + 1) : times_s.size(); }
  /// What TimeWeights refer to: the terms, and without harmonics after them the slopes m_k.
  size_t summands() const { return harmonics > 0 ? terms() : 2 * terms(); }
  /// At a time of the sequence; beyond its ends it wraps (cyclic) or is clamped.
  TimeWeights at(double time_s) const noexcept;
  /// At the share `phase` of the way from a frame to the next one.
  TimeWeights at(int frame, double phase) const noexcept;
  /// N: all frames but a last one that is the first once more.
  int frames_of_path() const noexcept { return int(times_s.size()) - (repeats_first ? 1 : 0); }

 private:
  double step_s(int frame) const noexcept;  ///< from the frame to the next
  double share(int frame, double phase) const noexcept;
};

/// One motion for a whole sequence: the material at X (LPS mm) in the reference frame is at X +
/// u(X, t) at time t. All frames are described from one frame, so errors do not add up over a
/// cycle: its drift is zero by construction, while fields from frame to frame drift. At the
/// reference frame's time u is zero up to rounding and the error of the harmonics.
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
  Field at(double time_s) const { return at(basis.at(time_s)); }
  Field at(const TimeWeights& time) const;
  /// u at frame k.
  Field at_frame(size_t k) const { return at(basis.at(int(k), 0.0)); }
  /// A summand: a term, or the slope m_k that follows from the terms (see TimeBasis).
  Field summand(size_t n) const;
};

/// The length of a cycle for frame times that do not contain it: the last frame leads back to the
/// first after the median step, which a missing frame does not change. Needs at least two times.
double cycle_of(std::span<const double> times_s);

/// sum_n weights[n] fields[n]; at least one field, all on one grid.
Field combined(const std::vector<Field>& fields, const TimeWeights& weights);

}  // namespace palpate
