#pragma once

#include <filesystem>
#include <limits>
#include <optional>
#include <vector>

#include "compute/volume/no_data.h"
#include "compute/volume/result.h"
#include "compute/volume/volume.h"
#include "integration/loading/load_scene.h"
#include "module/scene/derived_wall.h"
#include "module/session/note.h"

namespace palpate::loading {

/// What a wall is chosen by: a copy of one frame, and the range of the values in all frames.
struct WallFrame {
  size_t number = 0;        ///< the frame that one motion carries to the others, if there is one
  Volume values;            ///< of vectors their lengths; without samples: nothing was read
  bool of_vectors = false;  ///< the values are lengths of vectors
  double half_mm = 0.0;     ///< half the thickness that a wall needs to hold a hand; 0: any holds
  float low = std::numeric_limits<float>::infinity();
  float high = -std::numeric_limits<float>::infinity();

  /// The share of the volume outside of what was scanned (NoDataFinder), into which `values` are
  /// continued: the border of the data is no wall, as that of the grid is none.
  double no_data = 0.0;

  /// Takes the range of a frame, and of the frame with this number a copy.
  void add(size_t k, const Volume& frame);
  /// After the last frame: sets no_data.
  void leave_out_no_data();

 private:
  NoDataFinder finder_;
};

/// What is felt of a volume: a mode, or else a wall derived from its values.
struct ChosenWall {
  std::optional<ModeSpec> mode;  ///< of the values or vectors; its volume is not named yet
  std::optional<DerivedWall> derived;
  SegmentsSpec segments;    ///< with `derived`: how it was derived and is felt
  std::vector<Note> notes;  ///< why
};

/// Chooses what is felt where no scene file says it: a guide along vectors, an iso-surface of the
/// values, or a wall derived from them (FeltWall). A function of its arguments alone. can_carry:
/// one motion carries a wall of this frame to all others, or there are none, or it will be found.
/// kBadInput with one sentence, which begins with the file: no such surface. Uses all cores.
Result<ChosenWall> choose_wall(const WallFrame& frame, const SequenceChoices& choices,
                               bool can_carry, const std::filesystem::path& file);

/// The wall that `segments` derives from the values of a frame. kBadInput if nothing in it has a
/// border. Uses all cores.
Result<ChosenWall> derive_wall(const WallFrame& frame, const SegmentsSpec& segments,
                               const std::filesystem::path& file);

}  // namespace palpate::loading
