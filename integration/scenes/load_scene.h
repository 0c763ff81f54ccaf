#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "compute/volume/sequence.h"
#include "compute/volume/sequence_motion.h"
#include "module/session/loaded_scene.h"

namespace palpate::scenes {

/// Frames that a program has in memory instead of a file.
struct GivenVolume {
  Sequence frames;
  std::optional<SequenceMotion> motion;  ///< of all of them; none: estimated while they are felt
};

/// What surface is felt in values.
enum class FeltWall : uint8_t {
  /// kValues if that is a closed wall (kClosedWall), or if the motion that would carry another is
  /// neither known nor found; else kRegion
  kUsual,
  kValues,   ///< the iso-surface
  kRegion,   ///< region_wall()
  kRidges,   ///< ridge_wall()
  kNotFelt,  ///< kValues, without a word about it
};

/// How a sequence that comes without a scene is to be felt.
struct SequenceChoices {
  FeltWall wall = FeltWall::kUsual;
  std::optional<double> iso_value;  ///< the surface's value; none: found in the data
  std::optional<double> width;
  double strength_n = 4.0;
  double friction = 0.2;
  double frames_per_second = 0.0;  ///< 0: as the file says
  std::filesystem::path fields;    ///< of palpate motion: its folder, or its one file; empty: none
  bool cyclic = true;
  bool finds_motion = true;  ///< what motion is missing is found while it is felt
  /// The frames of files from which one motion for all of them is to be found stay in memory,
  /// beside their splines, until that is asked of them: they are not read a second time.
  bool holds_frames = false;
  std::optional<CarriedValues> values;  ///< of a scene file's volumes of files, too
  std::filesystem::path folder;         ///< where a scene file's paths begin; empty: beside it
  std::vector<std::filesystem::path> mode_libraries;  ///< with haptic modes that scenes may name
  std::vector<std::filesystem::path> segments;        ///< segmentations whose parts are the walls
  size_t segments_frame = 0;                          ///< to which a single one belongs
  std::vector<std::string> segment_names;             ///< of its parts; none: all
  /// By the name that stands in place of a file, in the inputs or in a scene file's "files".
  std::map<std::string, std::shared_ptr<const GivenVolume>> given;
};

/// Hears what is being done, in a few words for a person.
using OnDoing = std::function<void(const std::string&)>;

/// "heart", "shell" or "molecule", a scene file (.json, .x3d), or a sequence: a 4D file, a folder,
/// a list of 3D files, or a single frame. `doing` (may be empty) hears what is being done, for
/// example "reading frame 3 of 20". kBadInput in one sentence. Any thread.
Result<LoadedScene> load_scene(const std::vector<std::filesystem::path>& inputs,
                               const SequenceChoices& choices, const OnDoing& doing = {});

/// A scene in the words of a scene file (docs/scene-file.md); its paths begin at choices.folder.
/// kBadInput in one sentence. Any thread.
Result<LoadedScene> load_scene_text(const std::string& text, const SequenceChoices& choices,
                                    const OnDoing& doing = {});

/// What is only looked at: as load_scene, and several inputs that are no frames of one
/// sequence (other grids, or scalars and vectors) as volumes of their own, where they are beside
/// the first one. kBadInput.
Result<LoadedScene> load_shown_scene(const std::vector<std::filesystem::path>& inputs,
                                     const SequenceChoices& choices, const OnDoing& doing = {});

}  // namespace palpate::scenes
