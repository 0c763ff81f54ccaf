#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "compute/volume/frames.h"
#include "module/haptics/device.h"
#include "module/haptics/modes/modes.h"
#include "module/scene/moving_volume.h"
#include "module/scene/scene_spec.h"

namespace palpate {

/// A motion that nothing gives: to be estimated while the data are felt.
struct MissingMotion {
  size_t volume = 0;
  /// The volume's frames once more, as they were read: their splines do not give them back. Any
  /// thread.
  std::function<Result<Frames>()> open;
  /// The volume with all its frames, where the scene has it standing still until one motion for all
  /// of them is known; else null.
  std::shared_ptr<const MovingVolume> own;
};

/// A scene with its data, ready for a Session. Transforms are those at the start.
struct LoadedScene {
  std::string name;  ///< "heart", ..., or the file
  SceneSpec spec;
  std::vector<std::shared_ptr<const MovingVolume>> data;  ///< one per volume, in order
  std::vector<MissingMotion> missing;
  std::vector<std::string> notes;  ///< what was chosen for the person, a sentence each
  bool from_sequence = false;      ///< no scene file said where it is: it may be fitted to a device
  ModeKinds kinds;                 ///< of mode, that the spec may name
};

/// Forgets the known motion of synthetic data, so that it has to be found as a patient's would.
void forget_motion(LoadedScene& scene);

/// What nothing moves may be moved by a second hand, or by a host.
void make_movable(LoadedScene& scene);

/// Shrinks a sequence's volume so that its longest edge fits the device's reach; a smaller one
/// stays as it is. Returns the scale.
double fit_to_reach(LoadedScene& scene, const DeviceInfo& device);

}  // namespace palpate
