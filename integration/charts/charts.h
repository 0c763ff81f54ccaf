#pragma once

#include <optional>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "compute/volume/field.h"
#include "compute/volume/result.h"
#include "compute/volume/volume.h"

/// Pages of a pair or a sequence: frames, motion fields and their errors, as PNG.
///
/// All pictures cut the patient along axial, coronal and sagittal planes in LPS, whatever the
/// direction and spacing of the grid. They have one scale in mm, and hang as radiologists do:
/// patient's left on the right, front at the top or left, head up. Views on which the volume is
/// only a sliver (one slice) are left out. Fields and confidence may lie on a coarser grid than the
/// frame.
///
/// Every function writes its file whole or not at all (temporary file beside it, then rename) and
/// replaces an older one. Errors: kBadOutput if it can not be written, kBadInput if a volume or
/// field holds no samples or not as many as its grid says, kOutOfMemory. Any thread; the values are
/// only read.
namespace palpate::charts {

/// The words of a picture, and where to cut.
struct Caption {
  std::string title;     ///< one line, said large
  std::string subtitle;  ///< one line of numbers or explanation, may be empty
  /// Where the three planes meet, LPS mm; where most moves, or in the middle, if not given.
  std::optional<glm::dvec3> focus_lps_mm = std::nullopt;
};

/// What there is to show of a pair. Nothing is copied: all must outlive the call.
struct PairPicture {
  const Volume* fixed = nullptr;           ///< needed
  const Volume* moving = nullptr;          ///< needed
  const Field* field = nullptr;            ///< needed
  const Field* truth = nullptr;            ///< if known: a column with the error
  const Confidence* confidence = nullptr;  ///< if known: a column with the confidence
  const Mask* mask = nullptr;              ///< where arrows are drawn, and numbers are taken
};

/// A pair on one page: three views by fixed frame with arrows, difference before and after, motion
/// with the lattice it carries, and error and confidence as far as they are given; with the numbers
/// of each.
Status write_pair_overview(const std::string& path, const PairPicture& pair,
                           const Caption& caption);

/// One step of a sequence: a frame and the field that leads from it to the next.
struct SequenceStep {
  const Volume* frame = nullptr;
  const Field* field = nullptr;  ///< none after the last frame of a sequence that is not cyclic
  std::string label;             ///< "frame 0 \u2192 1"
  std::string sublabel;          ///< "t = 0.5 s"
};

/// A sequence on one page: one row per step, three views with arrows, one key and one window for
/// all. Of more than 12 steps only 12 are drawn, evenly spread, and the picture says so.
Status write_sequence_strip(const std::string& path, const std::vector<SequenceStep>& steps,
                            const Caption& caption);

}  // namespace palpate::charts
