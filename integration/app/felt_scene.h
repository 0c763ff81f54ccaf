#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "integration/app/frames.h"
#include "module/haptics/device.h"
#include "module/haptics/modes/modes.h"
#include "module/scene/moving_volume.h"
#include "module/scene/scene.h"

namespace palpate::app {

/// How a sequence that comes without a scene is to be felt.
struct SequenceChoices {
  std::optional<double> level;  ///< the surface's value; none: found in the data
  std::optional<double> width;
  double strength_n = 4.0;
  double friction = 0.2;
  double frames_per_second = 0.0;  ///< 0: as the file says
  std::filesystem::path fields;    ///< of palpate motion: its folder, or its one file; empty: none
  bool cyclic = true;
  std::optional<CarriedValues> values;  ///< of a scene file's volumes of files, too
  std::filesystem::path folder;         ///< where a scene file's paths begin; empty: beside it
  std::vector<std::filesystem::path> mode_libraries;  ///< with haptic modes that scenes may name
  std::vector<std::filesystem::path> segments;        ///< segmentations whose parts are the walls
  size_t segments_frame = 0;                          ///< to which a single one belongs
  std::vector<std::string> segment_names;             ///< of its parts; none: all
};

/// A motion that nothing gives: to be estimated while the data are felt.
struct MissingMotion {
  size_t volume = 0;
  std::function<Result<Frames>()> open;  ///< the volume's frames, once more
  /// The volume with all its frames, where the scene has it standing still until one motion for all
  /// of them is known; else null.
  std::shared_ptr<const MovingVolume> own;
};

/// Hears what is being done, in a few words for a person.
using OnDoing = std::function<void(const std::string&)>;

/// A scene with its data, ready to be assembled. Transforms are those at the start.
struct FeltScene {
  std::string name;  ///< "heart", ..., or the file
  SceneSpec spec;
  std::vector<std::shared_ptr<const MovingVolume>> data;  ///< one per volume, in order
  std::vector<MissingMotion> missing;
  std::vector<std::string> notes;  ///< what was chosen for the person, a sentence each
  bool from_sequence = false;      ///< no scene file said where it is: it may be fitted to a device
  ModeKinds kinds;                 ///< of mode, that the spec may name
};

/// "heart", "shell" or "molecule", a scene file (.json, .x3d), or a sequence: a 4D file, a folder,
/// a list of 3D files, or a single frame. `doing` (may be empty) hears what is being done, for
/// example "reading frame 3 of 20". kBadInput in one sentence. Any thread.
Result<FeltScene> load_felt_scene(const std::vector<std::filesystem::path>& inputs,
                                  const SequenceChoices& choices, const OnDoing& doing = {});

/// What is only looked at: as load_felt_scene, and several inputs that are no frames of one
/// sequence (other grids, or scalars and vectors) as volumes of their own, where they are beside
/// the first one. kBadInput.
Result<FeltScene> load_seen_scene(const std::vector<std::filesystem::path>& inputs,
                                  const SequenceChoices& choices, const OnDoing& doing = {});

/// Forgets the known motion of made data, so that it has to be found as a patient's would.
void forget_motion(FeltScene& scene);

/// Shrinks a sequence's volume so that its longest edge fits the device's reach; a smaller one
/// stays as it is. Returns the scale.
double fit_to_reach(FeltScene& scene, const DeviceInfo& device);

}  // namespace palpate::app
