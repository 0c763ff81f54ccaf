#pragma once

#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <vector>

#include "compute/motion/estimator.h"
#include "compute/volume/field.h"
#include "compute/volume/result.h"
#include "compute/volume/volume.h"

namespace palpate {

/// One motion for a whole sequence: the material point X (LPS mm, a place near the reference
/// frame's) is at X + u(X, t) at time t. All frames are told from one place, so nothing adds up
/// over a cycle: its drift is zero by construction, where fields that follow each other drift.
///
/// Cyclic data have u as harmonics of the cycle,
///   u(X, t) = c_0(X) + sum_h [a_h(X) cos(2 pi h t / T) + b_h(X) sin(2 pi h t / T)],
/// smooth in time and periodic. Without harmonics u is known at the frames and goes in straight
/// lines between them. u at the reference frame's time is small but not zero: what the frames say
/// of each other decides where it is, not one of them alone.
struct SequenceMotion {
  size_t reference = 0;         ///< the frame nearest to the mean of all
  std::vector<double> times_s;  ///< one per frame, rising
  double cycle_s = 0.0;         ///< T; 0: not cyclic
  std::vector<Field> at_frame;  ///< u(., t_k), mm, LPS, on the grid that the pairs were solved on
  /// c_0, a_1, b_1, a_2, b_2, ... on the same grid; empty: no harmonics.
  std::vector<Field> coefficients;

  int harmonics() const { return coefficients.empty() ? 0 : int(coefficients.size() - 1) / 2; }
  /// u(., t), any t for cyclic data, else held outside the frames' times. Allocates; any thread.
  Field at(double time_s) const;
};

/// The cycle's length that frame times leave open: the last frame leads back to the first after the
/// mean step. Needs two times or more.
double cycle_of(std::span<const double> times_s);

/// The frame whose material is nearest to the mean of all: of all frames r that one with the least
/// sum over k of mean_X |phi_k(X) - phi_r(X)|, phi_k composed from the fields of consecutive
/// frames.
size_t frame_nearest_the_mean(std::span<const Field> consecutive);

/// One sweep of neighbour consensus: what frame k says itself and what it gets from its neighbours
/// through the fields between them, as a weighted mean,
///   u_k <- [w u_k + w- (u_{k-1} + v_{k-1}(X + u_{k-1})) + w+ (u_{k+1} + v_k^-1(X + u_{k+1}))]
///          / (w + w- + w+).
/// direct: u_k, all on one grid. consecutive: v_k from frame k to k + 1, one less than frames, or
/// as many if cyclic; backward: their inverses on the same grids. confidence: of the direct fields,
/// or none (all weights 1). Uses all cores.
std::vector<Field> with_neighbours(std::span<const Field> direct,
                                   std::span<const Field> consecutive,
                                   std::span<const Field> backward,
                                   std::span<const Confidence> confidence);

/// The least-squares fit of a cycle's harmonics to fields at the given times: c_0, a_1, b_1, ....
/// Needs 2 * harmonics + 1 <= frames at different times of the cycle.
std::vector<Field> harmonics_of(std::span<const Field> at_frame, std::span<const double> times_s,
                                double cycle_s, int harmonics);

/// The field from frame k to the next as the sequence's motion says it: phi_{k+1}(phi_k^-1(y)) - y
/// on the same grid. k is the last frame only for cyclic data. Uses all cores.
Field consecutive_field(const SequenceMotion& motion, size_t k);

/// Frames as they are asked for, in any order and more than once. Called from one thread.
using FrameReader = std::function<Result<Volume>(size_t k)>;

struct SequenceMotionOptions {
  EstimatorOptions estimator;  ///< for every pair; `cyclic` of the sequence is here
  int sweeps = 2;              ///< of neighbour consensus
  /// Harmonics: as many as keep the values at material points as steady as none do, within this
  /// share of their SD.
  double steadiness = 0.01;
};

/// What is done and the share of all, 0 to 1.
using OnSequenceProgress = std::function<void(const std::string& doing, double share)>;

/// Estimates the motion of a sequence: pairs of consecutive frames, the reference frame from them,
/// pairs from the reference to all others, sweeps of neighbour consensus, and harmonics for cyclic
/// data. 2 N - 1 pairs for a cycle of N frames. `on_pair` (may be empty) hears each consecutive
/// pair as soon as it is known. Errors: of the reader and the estimator, kCancelled, kBadInput for
/// fewer than two frames.
Result<SequenceMotion> estimate_sequence_motion(const std::shared_ptr<vulkan::Context>& context,
                                                const Grid& grid, std::span<const double> times_s,
                                                const FrameReader& read,
                                                const SequenceMotionOptions& options,
                                                const SequenceEstimator::OnMotion& on_pair = {},
                                                const OnSequenceProgress& progress = {},
                                                std::stop_token stop = {});

}  // namespace palpate
