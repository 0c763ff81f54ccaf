#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compute/volume/frames.h"
#include "module/haptics/device.h"
#include "module/haptics/modes/modes.h"
#include "module/scene/moving_volume.h"
#include "module/scene/scene_spec.h"
#include "module/session/note.h"

namespace palpate {

/// A motion that no file contains, to be estimated while the data are felt.
struct MissingMotion {
  size_t volume = 0;
  /// Reads the volume's frames again: they can not be recovered from the splines. Any thread.
  std::function<Result<Frames>()> open;
  /// The volume with all its frames, if it stands still in the scene until one motion for all of
  /// them is known; else null.
  std::shared_ptr<const MovingVolume> own;
};

/// A scene with its data, ready for a Session. Transforms are those at the start.
struct LoadedScene {
  std::string name;  ///< "heart", ..., or the file name
  SceneSpec spec;
  std::vector<std::shared_ptr<const MovingVolume>> data;  ///< one per volume, in order
  std::vector<MissingMotion> missing;
  std::vector<Note> notes;  ///< choices made for the user, and what is unusual of the data
  /// there is no scene file that places it: it may be scaled to a device
  bool from_sequence = false;
  ModeKinds kinds;  ///< kinds of modes that the spec may name
};

/// The note on a volume whose times are assumed, or whose cycle is that of no heart and no breath;
/// none otherwise. of_scene_file: what says the times stands in a scene file.
std::optional<Note> times_note(const MovingVolume& volume, bool of_scene_file);

/// Removes the known motion of synthetic data, so that it is estimated as for measured data.
void forget_motion(LoadedScene& scene);

/// Lets a second hand, or a host, move the volumes that nothing else moves.
void make_movable(LoadedScene& scene);

/// Scales a sequence's volume down so that its longest edge fits the device's workspace; a smaller
/// one is not changed. Returns the scale.
double fit_to_reach(LoadedScene& scene, const DeviceInfo& device);

}  // namespace palpate
