#pragma once

#include <memory>
#include <string>
#include <vector>

#include "module/scene/moving_volume.h"
#include "module/scene/scene.h"

namespace palpate {

/// A motion of a volume, as far as a scene needs it.
struct MotionNeeds {
  std::string name;
  std::vector<std::string> modes;  ///< carried by it; none: it is not needed
  bool whole = false;              ///< one motion for all times, told from one frame
  int harmonics = 0;               ///< of it; 0: curves through the frames
  int steps = 0;                   ///< from frame to frame
  int known = 0;                   ///< of them; the others stand still until they are
  double moving_share = 0.0;       ///< of the samples of all known steps
  double largest_u_m = 0.0;        ///< displacement of a step
  float worst_contraction = 0.0F;  ///< q; below 1 every step can be inverted everywhere
  double least_determinant = 1.0;  ///< of det(I + du/dx), of one motion for all times
  size_t folded_cells = 0;
  size_t bytes = 0;
};

/// A volume, as far as a scene needs it.
struct VolumeNeeds {
  std::string name;
  std::vector<std::string> modes;  ///< that read it
  int frames = 0;
  double length_s = 0.0;
  bool cyclic = false;
  std::vector<MotionNeeds> motions;
  std::vector<std::string> each_tick;  ///< stages of a haptic frame, in order
  std::vector<std::string> left_out;   ///< what is not done, and why
};

/// What a scene needs, and what is left out and why: the stages that the haptic step is put
/// together from. Values, to be printed.
struct ScenePlan {
  std::vector<VolumeNeeds> volumes;
  std::vector<std::string> idle_modes;  ///< that are off at the start
};

/// The plan of a scene with its data (one per volume, in order). Any thread.
ScenePlan plan(const SceneSpec& spec, const std::vector<std::shared_ptr<const MovingVolume>>& data);

/// For a person: a paragraph per volume, lines of at most about 100 characters.
std::string text(const ScenePlan& plan);

}  // namespace palpate
