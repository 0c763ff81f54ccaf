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

namespace palpate::loading {

/// Frames that a program has in memory, used instead of a file.
struct GivenVolume {
  Sequence frames;
  std::optional<SequenceMotion> motion;  ///< of all frames; empty: estimated while they are felt
};

/// Which surface of the values is felt.
enum class FeltWall : uint8_t {
  /// kValues if that is a closed wall (kClosedWall), or if several frames have no motion, known or
  /// to be estimated, that carries another wall; else kRegion
  kUsual,
  kValues,   ///< the iso-surface
  kRegion,   ///< region_wall()
  kRidges,   ///< ridge_wall()
  kNotFelt,  ///< like kValues, without a note about it
};

/// How a sequence without a scene file is felt.
struct SequenceChoices {
  FeltWall wall = FeltWall::kUsual;
  std::optional<double> iso_value;  ///< value of the surface; empty: chosen from the data
  std::optional<double> width;
  double strength_n = 4.0;
  double friction = 0.2;
  double frames_per_second = 0.0;  ///< 0: as the file says
  std::optional<float> nan_as;     ///< VolumeSpec::nan_as of all volumes of files
  /// written by palpate motion: its folder, or its single file; empty: none
  std::filesystem::path fields;
  bool cyclic = true;
  bool finds_motion = true;  ///< missing motion is estimated while the data are felt
  /// Frames of files from which one motion for all of them will be estimated stay in memory, beside
  /// their splines, until then; they are not read a second time.
  bool holds_frames = false;
  std::optional<CarriedValues> values;  ///< also for volumes of files in a scene file
  std::filesystem::path folder;  ///< start of a scene file's relative paths; empty: its own folder
  std::vector<std::filesystem::path> mode_libraries;  ///< with haptic modes for scenes
  std::vector<std::filesystem::path> segments;        ///< segmentations whose parts become walls
  size_t segments_frame = 0;                          ///< the frame of a single segmentation
  std::vector<std::string> segment_names;             ///< names of the parts to use; empty: all
  /// By the name that is used instead of a file, in the inputs or in "files" of a scene file.
  std::map<std::string, std::shared_ptr<const GivenVolume>> given;
};

/// Called with a few words for the user on the present step.
using OnDoing = std::function<void(const std::string&)>;

/// Loads "heart", "shell" or "molecule", a scene file (.json, .x3d), or a sequence: a 4D file, a
/// folder, a list of 3D files, or a single frame. `doing` (may be empty) is called with each step,
/// for example "reading frame 3 of 20". Errors: kBadInput with one sentence. Any thread.
Result<LoadedScene> load_scene(const std::vector<std::filesystem::path>& inputs,
                               const SequenceChoices& choices, const OnDoing& doing = {});

/// Loads a scene from the text of a scene file (docs/scene-file.md); its paths are relative to
/// choices.folder. Errors: kBadInput with one sentence. Any thread.
Result<LoadedScene> load_scene_text(const std::string& text, const SequenceChoices& choices,
                                    const OnDoing& doing = {});

/// Loads a scene for viewing only: as load_scene(); in addition several inputs that are not frames
/// of one sequence (different grids, or scalars and vectors) become separate volumes, at their
/// places relative to the first one. Errors: kBadInput.
Result<LoadedScene> load_shown_scene(const std::vector<std::filesystem::path>& inputs,
                                     const SequenceChoices& choices, const OnDoing& doing = {});

}  // namespace palpate::loading
