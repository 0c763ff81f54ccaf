#pragma once

#include <memory>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "module/haptics/mode.h"
#include "module/haptics/modes/modes.h"
#include "module/scene/moving_volume.h"
#include "module/scene/scene_spec.h"

namespace palpate {

/// Where the transform of a volume in a haptic frame comes from.
enum class PoseStage : uint8_t {
  kNone,    ///< it does not change: no pose is asked for
  kDrive,   ///< its drive gives the pose at every haptic frame's own time
  kNewest,  ///< the newest pose that a second hand has sent
  kPaper,   ///< sent poses, blended over the estimated frame time
  kSmooth,  ///< a smooth path through sent poses
};

/// How the data of a volume are brought to their phase in a haptic frame.
enum class DataStage : uint8_t {
  kStill,     ///< one frame that stands still: there is no time
  kMaterial,  ///< one frame's values, carried by one motion for all times
  kFrames,    ///< the values of each frame, carried to the next one by a field per step
};

/// A volume ready to be felt and shown, and what a haptic frame has to compute for it.
struct SceneVolume {
  VolumeSpec spec;
  std::shared_ptr<const MovingVolume> data;  ///< frames, times, motions
  PoseStage pose = PoseStage::kNone;
  DataStage phase = DataStage::kStill;
  bool blends = false;  ///< kFrames: the values of two frames are blended, equation (24)

  bool is_posed() const { return pose != PoseStage::kNone; }
  bool is_still() const { return phase == DataStage::kStill; }
  /// Its poses come from outside the loop; the session sends them.
  bool is_sent() const { return is_posed() && pose != PoseStage::kDrive; }
};

/// A mode ready to be felt.
struct SceneMode {
  ModeSpec spec;
  std::shared_ptr<const Mode> mode;
  int carrier = 0;   ///< index: the volume and motion that carry it
  int segment = -1;  ///< index of the volume's segment that it reads; -1: the values
  /// the tool is a ball, and the mode a surface of values, which are read where it touches them
  bool reads_contact = false;
};

/// One motion of a volume's data. Modes of one volume that name the same motion share the carrier,
/// and with it the material point that the proxy rests on. For data that do not move there is no
/// time in it.
struct SceneCarrier {
  int volume = 0;
  const Motion* motion = nullptr;  ///< null: the data do not move, or one motion moves them all
};

/// A scene as it is felt, shown and printed: what each haptic frame has to do, and nothing else.
/// The loop runs these stages, text() prints them. Immutable, shared between threads by pointer.
struct Scene {
  std::vector<SceneVolume> volumes;
  std::vector<SceneMode> modes;
  std::vector<SceneCarrier> carriers;  ///< only those that a mode needs
  double stiffness_n_per_m = 600.0;
  double damping_n_s_per_m = 0.0;
  double tool_radius_m = 0.0;  ///< of a ball, world; 0: points
  /// Of the tool, from its tip: along the axes of the grip (GripReading), as long as in the world,
  /// m. Their sum is zero.
  std::vector<glm::dvec3> points_m{glm::dvec3(0.0)};
  Transform world_from_device;
};

/// Joins a scene's specification with its data (one MovingVolume per volume of the spec, in order),
/// makes its modes and decides the stages of a haptic frame. kBadInput, in one sentence: a mode of
/// an unknown volume, motion or kind, data that do not fit together, more than kMostModes modes, a
/// transform with a negative determinant or another number that is out of range. Allocates; any
/// thread but the servo's.
/// A tool of n points: 2 to 4 are on a circle of the tool's radius across the grip's shaft, the
/// first along the grip's x axis; of 5 the last is in its middle.
Result<std::shared_ptr<const Scene>> plan(const SceneSpec& spec,
                                          std::vector<std::shared_ptr<const MovingVolume>> data,
                                          const ModeKinds& kinds = {});

/// The scene with other data for one of its volumes, such as one more step of its motion. All else
/// is shared with the scene before, its modes included; the stages of that volume are decided anew.
/// kBadInput, in one sentence: the data do not fit together, or lack a motion or segment that a
/// mode names. Allocates a few hundred bytes; any thread but the servo's.
Result<std::shared_ptr<const Scene>> with_data(const Scene& scene, size_t volume,
                                               std::shared_ptr<const MovingVolume> data);

/// What a scene works out in each haptic frame, what it leaves out, and why: a paragraph per
/// volume, lines of at most about 100 characters. Any thread.
std::string text(const Scene& scene);

/// No more modes than bits in the word that tells which of them hold, and than primitives fit in
/// one balance.
constexpr int kMostModes = 16;

}  // namespace palpate
