#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "compute/motion/estimator.h"
#include "compute/motion/quality.h"
#include "compute/volume/field.h"
#include "compute/volume/result.h"
#include "compute/volume/sequence_motion.h"
#include "compute/volume/volume.h"

namespace palpate {

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
/// smoothed so that the mean does not jump where they disagree, or none (all weights 1). Uses all
/// cores.
std::vector<Field> with_neighbours(std::span<const Field> direct,
                                   std::span<const Field> consecutive,
                                   std::span<const Field> backward,
                                   std::span<const Confidence> confidence);

/// The least-squares fit of a cycle's harmonics to fields at the times of `basis`: its terms. Needs
/// 2 * harmonics + 1 <= frames at different times of the cycle, and harmonics of 1 or more.
std::vector<Field> harmonics_of(std::span<const Field> at_frame, const TimeBasis& basis);

/// The same motion told from its reference frame: places X become phi_ref(X), so that u(., t_ref)
/// is zero and the reference frame's own values are the material's. `motion` may be told from
/// anywhere near, as it is after sweeps of neighbour consensus.
SequenceMotion told_from_reference(const SequenceMotion& motion);

/// The field from frame k to the next as the sequence's motion says it: phi_{k+1}(phi_k^-1(y)) - y
/// on the same grid. k is the last frame only for cyclic data. Uses all cores.
Field consecutive_field(const SequenceMotion& motion, size_t k);
/// The same at the samples of another grid: exact there, where the motion's own grid is coarse.
Field consecutive_field(const SequenceMotion& motion, size_t k, const Grid& onto);

/// Where points are after a cycle of the fields from frame to frame that follow from a cyclic
/// motion, at the samples of `image` (inside the mask on it, if not null).
Distances drift_of(const SequenceMotion& motion, const Grid& image, const Mask* mask);

/// One motion from the fields of consecutive frames (one less than frames, or as many if cyclic),
/// told from a frame of them: forward to those after it, and backward by the inverses to those
/// before it; in a cycle each frame is reached the shorter way round. No harmonics. kBadInput if a
/// field is missing or their number does not fit. Uses all cores.
Result<SequenceMotion> motion_of_steps(std::span<const Field> consecutive, const TimeBasis& times,
                                       size_t reference);

/// Frames as they are asked for, in any order and more than once. Called from one thread.
using FrameReader = std::function<Result<Volume>(size_t k)>;

struct SequenceMotionOptions {
  EstimatorOptions estimator;  ///< for every pair; `cyclic` of the sequence is here
  int sweeps = 2;              ///< of neighbour consensus
  /// Harmonics: the fewest that keep the values at material points as steady as none do, within
  /// this share, and tell left-out frames as well as the best number does, within that one. Both
  /// from docs/decisions/motion-engine.md, "One motion for a sequence".
  double steadiness = 0.01;
  double left_out = 0.15;
  /// Told from this frame, below the number of frames; none: from the one nearest the mean.
  std::optional<size_t> reference;
};

/// What was met on the way, beside the motion itself.
struct SequenceReport {
  /// How far to trust the field from the reference to each frame.
  std::vector<Confidence> confidence;
  /// How unsteady the values at material points are: without harmonics, then with 1, 2, ...; empty
  /// where that was not asked.
  std::vector<double> unsteadiness;
  /// For a person, a sentence each: equal frames, a cycle that does not close.
  std::vector<std::string> notes;
};

/// What is done and the share of all, 0 to 1.
using OnSequenceProgress = std::function<void(const std::string& doing, double share)>;

/// Estimates the motion of a sequence: pairs of consecutive frames, the reference frame from them,
/// pairs from the reference to all others, sweeps of neighbour consensus, and harmonics for cyclic
/// data. 2 N - 1 pairs for a cycle of N frames. A cycle is closed only if the last frame does lead
/// back to the first; if the last is the first once more, the cycle ends there. `on_pair` (may be
/// empty) hears each consecutive pair as soon as it is known; `report` (may be null) is filled.
/// Errors: of the reader and the estimator, kCancelled, kBadInput for
/// fewer than two frames.
Result<SequenceMotion> estimate_sequence_motion(
    const std::shared_ptr<vulkan::Context>& context, const Grid& grid,
    std::span<const double> times_s, const FrameReader& read, const SequenceMotionOptions& options,
    const SequenceEstimator::OnMotion& on_pair = {}, const OnSequenceProgress& progress = {},
    std::stop_token stop = {}, SequenceReport* report = nullptr);

}  // namespace palpate
