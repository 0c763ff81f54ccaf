#pragma once

#include <memory>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "module/haptics/mode.h"
#include "module/haptics/modes/modes.h"
#include "module/scene/moving_volume.h"
#include "module/scene/scene.h"

namespace palpate {

/// A volume ready to be felt.
struct HapticVolume {
  VolumeSpec spec;  ///< transform, drive, path, back-tracking, rate, blending
  std::shared_ptr<const MovingVolume> data;  ///< frames, times, motions
  bool posed = false;                        ///< its transform may change while the loop runs
  /// Its pose is the drive's own, at every haptic frame's time.
  bool asks_drive() const {
    return posed && spec.path == PosePath::kExact &&
           spec.drive.kind != DriveSpec::Kind::kSecondHand;
  }
};

/// A mode ready to be felt.
struct HapticMode {
  ModeSpec spec;
  std::shared_ptr<const Mode> mode;
  int carrier = 0;   ///< index: the volume and motion that carry it
  int segment = -1;  ///< index of the volume's segment that it reads; -1: the values
};

/// One way in which a volume's data move: modes of one volume that name the same motion share it,
/// and with it the point of the material that the proxy rests on. At the stage of a still volume
/// nothing of time is left.
struct CarrierPlan {
  int volume = 0;
  const Motion* motion = nullptr;  ///< null: the data do not move
};

/// A scene put together: what each haptic frame has to do, and nothing else. Immutable, shared
/// between threads by pointer.
struct HapticScene {
  std::vector<HapticVolume> volumes;
  std::vector<HapticMode> modes;
  std::vector<CarrierPlan> carriers;  ///< only those that a mode needs
  double stiffness_n_per_m = 600.0;
  double damping_n_s_per_m = 0.0;
  Transform world_from_device;
};

/// Joins a scene's words with its data (one MovingVolume per volume of the spec, in order) and
/// makes its modes. kBadInput, in one sentence: a mode of an unknown volume, motion or kind, data
/// that do not fit together, more than kMostModes modes, a transform with a negative determinant or
/// another number that can not be felt. Allocates; any thread but the servo's.
Result<std::shared_ptr<const HapticScene>> assemble(
    const SceneSpec& spec, std::vector<std::shared_ptr<const MovingVolume>> data,
    const ModeKinds& kinds = {});

/// No more modes than bits in the word that tells which of them hold, and than primitives fit in
/// one balance.
constexpr int kMostModes = 16;

}  // namespace palpate
