#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "compute/motion/frame_order.h"
#include "compute/motion/quality.h"

namespace palpate {

enum class Trust {
  kOk,       ///< nothing speaks against the field
  kSuspect,  ///< a person should check it before using it
  kFailed,   ///< do not use it
};

/// The verdict on a field, with its reasons.
struct Verdict {
  Trust trust = Trust::kOk;
  /// Findings against the field, one sentence each with the measured number and its limit; worst
  /// first. Empty if ok.
  std::vector<std::string> reasons;
  /// Checks that were passed, in the same form.
  std::vector<std::string> passed;
};

/// "ok", "suspect" or "failed".
const char* word(Trust trust);

/// Two limits: above the first a measure makes a field suspect, above the second failed. For names
/// that end in `least`: below.
struct Limit {
  double suspect;
  double failed;
};

/// All thresholds of the verdict, with their reasons. "Good" fields belong to real pairs, with
/// known motion or not, and to phantoms, and are right to half a voxel; "wrong" ones are deliberate
/// failures on the same pairs. The measurements of both are in docs/decisions/motion-engine.md, and
/// tests/motion/verdict_data_test.cpp repeats them. A limit lies about halfway between good and
/// wrong, or well beyond the good where other measures find the wrong.
struct Limits {
  /// Share of voxels that fold. palpate's own fields have none, so a single one is suspect; above a
  /// thousandth whole regions are inverted.
  Limit folded_share{0.0, 1e-3};
  /// SD of log det. Good: 0.01 to 0.28; wrong: up to 1.3. A body does not grow and shrink by a
  /// factor of 1.6 everywhere between two frames.
  Limit sd_log_det{0.5, 1.0};
  /// Share of blocks with structure, of fixed or moving. An empty frame, or one of noise, has none;
  /// a heart in the middle of a large field of view still fills some per cent.
  Limit textured_share_least{0.01, 0.002};
  /// Ratio of the structure of the two frames. The same body shows the same, but a gain of 0.7 to
  /// 1.4 with unchanged noise changes it up to twofold.
  Limit texture_ratio{4.0, 10.0};
  /// Mean local correlation after motion correction. Good: 0.86 and more; wrong: up to 0.93 (half
  /// of the true motion), two bodies 0.11 to 0.68.
  Limit correlation_least{0.75, 0.6};
  /// Share of the clear blocks that do not match after motion correction (correlation below 0.5).
  /// Good: up to 0.04; wrong: from 0.01 (half of the true motion), two bodies from 0.21.
  Limit mismatched{0.08, 0.3};
  /// By how much the field lowers the mean local correlation compared with no motion. A good field
  /// does not; noise of the mean is about 0.005.
  Limit correlation_lost{0.02, 0.1};
  /// Motion that remains between the frames, voxels of each axis. Good: 0.01 to 0.14, and 0.22 on a
  /// phantom of 48^3 where 0.15 is missed; wrong, where nothing else speaks against the field: from
  /// 0.46.
  Limit motion_left_voxels{0.3, 0.5};
  /// Share of the structure that still moves by more than half a voxel (Match::moving_share). Good:
  /// up to 0.02 on real pairs, and 0.07 on waves of 40 voxels; short waves that were missed at a
  /// third to a half of the voxels: from 0.27, and 0.51 at most, so failed is beyond that.
  Limit moving_share{0.15, 0.7};
  /// Share of the structure that the field moves out of the moving frame. This alone makes no field
  /// wrong (crops lose 0.14, and a shift by a third of the picture is found), but nothing can be
  /// compared there.
  Limit leaving{0.25, 0.5};
  /// Inverse consistency, mean, voxels of each axis. Good: up to 1.1, most of it the error of the
  /// quick backward field; wrong: from 2.4.
  Limit inverse_mean_voxels{2.0, 4.0};
  /// Inverse consistency, 99th percentile, voxels of each axis. Good: up to 5.8, at the border of
  /// the image, at sliding borders and where slices enter and leave; wrong: from 7.7, mostly above
  /// 15. Never failed by this alone: two livers that move by 20 mm past a still wall have more than
  /// 15 because the quick backward field is wrong there, while landmarks inside are off by 2.5 and
  /// 2.8 mm with the field itself.
  Limit inverse_p99_voxels{7.0, std::numeric_limits<double>::infinity()};
  /// Drift after one cycle, mean, voxels of each axis. palpate requires 0.3 of its own results;
  /// plain chaining reaches one.
  Limit drift_mean_voxels{1.0, 4.0};
  /// Share of the voxels with structure at which confidence is low. Good: up to 0.17, and 0.57
  /// between the two ends of a heart's beat; two bodies: 0.95 and more, but for one with 0.65.
  Limit low_confidence{0.75, 0.9};
  /// How far the path leaves the straight line between two frames beyond what the frames support
  /// (Excursion), voxels. Good: 0 for curves and up to half as many harmonics as frames could
  /// have, 0.08 for as many as possible.
  Limit beyond_voxels{0.1, 0.5};
  /// FrameOrder, of sequences whose steps are at least this many voxels long where the path leads
  /// back; shorter ones are noise. In the right order to_and_fro was 0 and onward above 0.
  double order_step_voxels = 0.25;
  double to_and_fro = 0.02;
  double onward_least = -0.1;
};

/// Measurements of one field (drift: of one cycle). What is absent is not judged.
struct Evidence {
  std::optional<Folds> folds;
  std::optional<Match> match;
  std::optional<Distances> inverse;      ///< inverse_consistency()
  std::optional<Distances> drift;        ///< cycle_drift()
  std::optional<double> low_confidence;  ///< low_confidence_share(), best of clear voxels
  std::optional<double> within_95_mm;    ///< error_radius_mm() of clear voxels; not judged
};

/// The verdict on measurements. A field that was never compared with its frames (no `match`) is at
/// best suspect. Any thread.
Verdict judged(const Evidence& evidence, const Limits& limits = {});

/// Measures everything that can be measured on a pair and its field, for judged(). backward,
/// confidence and mask may be null; the mask is on fixed's grid. Folds are counted on u's own grid;
/// consistency, confidence and the radius where the frames show structure (Match::clear), with a
/// mask only where both x and x + u(x) lie inside. structure: null, or set to the voxels with
/// structure. Errors: kBadInput as from match(). Any thread; uses all cores.
Result<Evidence> examined(const Volume& fixed, const Volume& moving, const Field& u,
                          const Field* backward = nullptr, const Confidence* confidence = nullptr,
                          const Mask* mask = nullptr, Mask* structure = nullptr);

/// How far the path of the material between a frame and the next leaves the straight line.
struct Excursion {
  double mm = 0.0;  ///< the farthest place from the line between its places in the two frames
  /// By how much, at most, that is more than a third of the longest step: of this one and its two
  /// neighbours. Voxels of the grid's finest axis; 0 if it is not.
  double beyond_voxels = 0.0;
};

/// Measurements of one motion for a whole sequence at one of its frames.
struct FrameEvidence {
  Spread motion_mm;   ///< displacement of the reference's material
  Evidence evidence;  ///< of u(reference -> frame), with the two frames if they are known
  /// of u on the way to the next frame, where it is worst; empty after the last
  Folds between;
  Excursion excursion;  ///< on the way to the next frame
  /// rms of u_{k+1} - 2 u_k + u_{k-1} of the material, mm per step^2; 0 at the first and last frame
  /// if not cyclic. Meaningful only for equal time steps.
  double acceleration_mm = 0.0;
};

struct SequenceEvidence {
  size_t reference = 0;
  std::vector<FrameEvidence> frames;
  std::optional<Distances> drift;  ///< of the fields from frame to frame that follow from it
  std::optional<FrameOrder> order;
  std::string ordered_by;  ///< what put the frames in this order, for people; empty: not known
};

/// As bad as its worst frame, which is named first (after a wrong order, which explains others);
/// drift, and folds and excursions between frames count, too. The reference's own field, which is
/// about zero, is left out. The limits are those of pairs.
Verdict judged(const SequenceEvidence& evidence, const Limits& limits = {});

/// Whether frames were compared and show structure. Where they do not, noise moves, in any order.
bool shows_structure(const Evidence& evidence, const Limits& limits = {});

/// The verdict on the order of the frames: suspect if the path jumps to and fro. `ordered_by` as in
/// SequenceEvidence.
Verdict judged(const FrameOrder& order, const std::string& ordered_by, const Limits& limits = {});

/// Adds the verdict on a part to that on the whole, which is as bad as its worst part. `where`
/// starts each of the added reasons, for example "Frames 3 to 4"; `passed` of the part is not
/// added.
void add(Verdict& whole, const Verdict& part, const std::string& where);

}  // namespace palpate
