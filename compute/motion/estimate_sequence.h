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

/// The frame whose material is nearest to the mean of all frames: the r with the least sum over k
/// of mean_X |phi_k(X) - phi_r(X)|, with phi_k composed from the fields of consecutive frames.
size_t frame_nearest_the_mean(std::span<const Field> consecutive);

/// One sweep of neighbour consensus: the weighted mean of the field estimated at frame k and of
/// what its neighbours' fields predict for it through the steps between them,
///   u_k <- [w u_k + w- (u_{k-1} + v_{k-1}(X + u_{k-1})) + w+ (u_{k+1} + v_k^-1(X + u_{k+1}))]
///          / (w + w- + w+).
/// direct: u_k, all on one grid. consecutive: v_k from frame k to k + 1, one less than frames, or
/// as many as frames if cyclic. backward: their inverses on the same grids. confidence: of the
/// direct fields, smoothed so that the mean does not jump where they disagree; empty: all weights
/// are 1. Fields in mm, LPS. Uses all cores.
std::vector<Field> with_neighbours(std::span<const Field> direct,
                                   std::span<const Field> consecutive,
                                   std::span<const Field> backward,
                                   std::span<const Confidence> confidence);

/// The least-squares fit of a cycle's harmonics to the fields of its frames: the terms of the fit.
/// Needs harmonics >= 1 and 2 * harmonics + 1 frames (basis.frames_of_path()) or more.
std::vector<Field> harmonics_of(std::span<const Field> at_frame, const TimeBasis& basis);

/// The same motion expressed from its reference frame: places X become phi_ref(X), so that u(.,
/// t_ref) is zero and material values are those of the reference frame. In `motion` u(., t_ref)
/// need only be small, as after sweeps of neighbour consensus.
SequenceMotion told_from_reference(const SequenceMotion& motion);

/// The field from frame k to the next that follows from the sequence's motion:
/// phi_{k+1}(phi_k^-1(y)) - y, on the same grid. k may be the last frame only for cyclic data. Uses
/// all cores.
Field consecutive_field(const SequenceMotion& motion, size_t k);
/// The same at the samples of another grid; exact there even if the motion's own grid is coarse.
Field consecutive_field(const SequenceMotion& motion, size_t k, const Grid& onto);

/// Drift of points after one cycle of the frame-to-frame fields that follow from a cyclic motion,
/// at the samples of `image` (only inside `mask`, a mask on that grid, if not null).
Distances drift_of(const SequenceMotion& motion, const Grid& image, const Mask* mask);

/// One motion from the fields of consecutive frames (one less than frames, or as many if cyclic),
/// from one of them as the reference. Later frames through the fields, earlier frames through their
/// inverses; in a cycle each frame is reached the shorter way round. No harmonics. Errors:
/// kBadInput if a field is missing or their number does not fit. Uses all cores.
Result<SequenceMotion> motion_of_steps(std::span<const Field> consecutive, const TimeBasis& times,
                                       size_t reference);

/// Returns frame k; called in any order, and more than once per frame, from one thread.
using FrameReader = std::function<Result<Volume>(size_t k)>;

struct SequenceMotionOptions {
  EstimatorOptions estimator;  ///< for every pair; its `cyclic` applies to the sequence
  int sweeps = 2;              ///< of neighbour consensus
  /// Harmonics: the smallest number that (a) keeps the values at material points as steady as no
  /// harmonics do, within this share, and (b) predicts left-out frames as well as the best number
  /// does, within the next one. Both from docs/decisions/motion-engine.md, "One motion for a
  /// sequence".
  double steadiness = 0.01;
  double left_out = 0.15;
  /// The reference frame, below the number of frames; empty: the frame nearest the mean.
  std::optional<size_t> reference;
};

/// Findings of the estimation, beside the motion itself.
struct SequenceReport {
  /// Confidence of the field from the reference to each frame.
  std::vector<Confidence> confidence;
  /// How unsteady the values at material points are: without harmonics, then with 1, 2, ...; empty
  /// if harmonics were not to be chosen.
  std::vector<double> unsteadiness;
  /// Sentences for the user: equal frames, a cycle that does not close.
  std::vector<std::string> notes;
};

/// Current step, and share of the whole work that is done, 0 to 1.
using OnSequenceProgress = std::function<void(const std::string& doing, double share)>;

/// Estimates the motion of a sequence: pairs of consecutive frames, the reference frame from them,
/// pairs from the reference to all others, sweeps of neighbour consensus, and harmonics for cyclic
/// data. 2 N - 1 pairs for a cycle of N frames. A cycle is closed only if the last frame leads back
/// to the first; if the last frame repeats the first, the cycle ends there. `on_pair` (may be
/// empty) is called with each consecutive pair as soon as it is estimated; `report` (may be null)
/// is filled. Errors: those of the reader and the estimator, kCancelled, kBadInput for fewer than
/// two frames.
Result<SequenceMotion> estimate_sequence_motion(
    const std::shared_ptr<vulkan::Context>& context, const Grid& grid,
    std::span<const double> times_s, const FrameReader& read, const SequenceMotionOptions& options,
    const SequenceEstimator::OnMotion& on_pair = {}, const OnSequenceProgress& progress = {},
    std::stop_token stop = {}, SequenceReport* report = nullptr);

/// A coarse motion of the same sequence in a small share of the time. It has the fields from frame
/// `reference` to all others, as estimated on the frames' means over blocks of 4 voxels (less along
/// an axis whose voxels are longer: the grid of the pyramid's third level), with harmonics for
/// cyclic data. Its cells are two such blocks wide, so borders at which material slides are
/// blurred. `cyclic` as in EstimatorOptions. Errors: those of the reader and the estimator,
/// kCancelled, kBadInput for frames that are too small to be made coarser.
Result<SequenceMotion> estimate_coarse_motion(const std::shared_ptr<vulkan::Context>& context,
                                              const Grid& grid, std::span<const double> times_s,
                                              const FrameReader& read, bool cyclic,
                                              size_t reference,
                                              const OnSequenceProgress& progress = {},
                                              std::stop_token stop = {});

}  // namespace palpate
