#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compute/motion/quality.h"

namespace palpate {

enum class Trust {
  kOk,       ///< nothing speaks against the field
  kSuspect,  ///< a person should look before using it
  kFailed,   ///< do not use it
};

/// One word about a field, and why.
struct Verdict {
  Trust trust = Trust::kOk;
  /// What speaks against the field, one sentence each with the measured number and its limit; worst
  /// first. Empty if ok.
  std::vector<std::string> reasons;
  /// What was checked and found good, in the same form.
  std::vector<std::string> passed;
};

/// "ok", "suspect" or "failed".
const char* word(Trust trust);

/// Two limits: above the first a measure makes a field suspect, above the second failed. Where the
/// name says `least`, below.
struct Limit {
  double suspect;
  double failed;
};

/// All thresholds of the verdict, in one place, with their reasons. "Good" are the fields of real
/// pairs, known or not, and of phantoms, that are right to half a voxel; "wrong" are the failures
/// made on purpose of the same pairs. What was measured of both stands in
/// docs/decisions/motion-engine.md, and tests/motion/verdict_data_test.cpp measures it again. A
/// limit lies about halfway between the two, or well beyond the good where others tell the wrong.
struct Limits {
  /// Share of voxels that fold. palpate's own fields have none, so one is worth a look; above a
  /// thousandth whole regions are turned inside out.
  Limit folded_share{0.0, 1e-3};
  /// SD of log det. Good: 0.01 to 0.28; wrong: up to 1.3. A factor 1.6 up and down everywhere is
  /// not how one body moves between two frames.
  Limit sd_log_det{0.5, 1.0};
  /// Share of blocks with structure, of fixed or moving. An empty frame, or one of noise, has none;
  /// a heart in the middle of a large field of view still fills some per cent.
  Limit textured_share_least{0.01, 0.002};
  /// How many times more structure one frame shows than the other. The same body shows the same,
  /// but a gain of 0.7 to 1.4 beside unchanged noise can hide or show as much as twice.
  Limit texture_ratio{4.0, 10.0};
  /// Mean local correlation after motion correction. Good: 0.86 and more; wrong: up to 0.93 (half
  /// of the true motion), two bodies 0.11 to 0.68.
  Limit correlation_least{0.75, 0.6};
  /// Share of the clear blocks that do not match after motion correction (correlation below 0.5).
  /// Good: up to 0.04; wrong: from 0.01 (half of the true motion), two bodies from 0.21.
  Limit mismatched{0.08, 0.3};
  /// By how much the field makes the mean local correlation worse than no motion at all. A good
  /// field can not; noise of the mean is about 0.005.
  Limit correlation_lost{0.02, 0.1};
  /// The motion that the frames still show, voxels of each axis. Good: 0.01 to 0.14, and 0.22 on a
  /// phantom of 48^3 where 0.15 is missed; wrong, where nothing else speaks against the field: from
  /// 0.46.
  Limit motion_left_voxels{0.3, 0.5};
  /// Share of the structure that still moves by more than half a voxel (Match::moving_share). Good:
  /// up to 0.02 on real pairs, and 0.07 on waves of 40 voxels; short waves that were missed at a
  /// third to a half of the voxels: from 0.27, and 0.51 at most, so failed is beyond that.
  Limit moving_share{0.15, 0.7};
  /// Share of the structure that the field carries out of the moving frame. That makes no field
  /// wrong: crops lose 0.14, and a shift by a third of the picture is found. But there nothing is
  /// compared.
  Limit leaving{0.25, 0.5};
  /// Inverse consistency, mean, voxels of each axis. Good: up to 1.1, most of it the error of the
  /// quick way back; wrong: from 2.4.
  Limit inverse_mean_voxels{2.0, 4.0};
  /// Inverse consistency, 99th percentile, voxels of each axis. Good: up to 5.8, where the picture
  /// ends, at sliding borders and where slices come and go; wrong: from 7.7, mostly above 15.
  Limit inverse_p99_voxels{7.0, 15.0};
  /// Drift after one cycle, mean, voxels of each axis. 0.3 is what palpate demands of itself, one
  /// is what plain chaining reaches.
  Limit drift_mean_voxels{1.0, 4.0};
  /// Share of the voxels with structure at which confidence is low. Good: up to 0.17, and 0.57
  /// between the two ends of a heart's beat; two bodies: 0.95 and more, but for one with 0.65.
  Limit low_confidence{0.75, 0.9};
};

/// What was measured about one field (or, for drift, about one cycle). What is absent is not
/// judged.
struct Evidence {
  std::optional<Folds> folds;
  std::optional<Match> match;
  std::optional<Distances> inverse;      ///< inverse_consistency()
  std::optional<Distances> drift;        ///< cycle_drift()
  std::optional<double> low_confidence;  ///< low_confidence_share(), best of clear voxels
};

/// The verdict on what was measured. A field that was never compared with its frames (no `match`)
/// is at best suspect.
Verdict judged(const Evidence& evidence, const Limits& limits = {});

/// Measures what can be measured about a pair and its field; judged() makes a verdict of it.
/// backward, confidence and mask may be null; the mask is on fixed's grid. Folds are counted on u's
/// own grid, consistency and confidence where the frames show structure (Match::clear), with a mask
/// where both x and x + u(x) lie inside. structure: null, or it becomes the voxels with structure.
/// Errors: kBadInput as from match(). Any thread; uses all cores.
Result<Evidence> examined(const Volume& fixed, const Volume& moving, const Field& u,
                          const Field* backward = nullptr, const Confidence* confidence = nullptr,
                          const Mask* mask = nullptr, Mask* structure = nullptr);

/// What was measured of one motion for a whole sequence at one of its frames.
struct FrameEvidence {
  Spread motion_mm;   ///< how far the reference's material is from where it was
  Evidence evidence;  ///< u(reference -> frame), with the two frames where they are known
  Folds between;      ///< of u in the middle of the step to the next frame; empty after the last
  /// Of the material, rms of u_{k+1} - 2 u_k + u_{k-1}, mm per step^2; 0 at the ends of what is not
  /// cyclic. Only meant for even times.
  double acceleration_mm = 0.0;
};

struct SequenceEvidence {
  size_t reference = 0;
  std::vector<FrameEvidence> frames;
  std::optional<Distances> drift;  ///< of the fields from frame to frame that follow from it
};

/// As bad as its worst frame, which is named first; drift and folds between frames count, too. The
/// reference's own field says nothing and is left out. The limits are those of pairs.
Verdict judged(const SequenceEvidence& evidence, const Limits& limits = {});

/// Adds a verdict to that of a larger whole, which is as bad as its worst part. `where` starts each
/// of its reasons, for example "Frames 3 to 4"; of what passed nothing is taken over.
void add(Verdict& whole, const Verdict& part, const std::string& where);

}  // namespace palpate
