#pragma once

#include <array>
#include <memory>
#include <vector>

#include "compute/vulkan/context.h"
#include "module/haptics/scene.h"
#include "module/haptics/scene_snapshot.h"
#include "module/session/hand_tubes.h"
#include "module/view/stream_lines.h"
#include "module/view/view_scene.h"
#include "module/view/volume_renderer.h"

namespace palpate {

/// What a person who looks may change.
struct ViewChoices {
  std::string look = "auto";  ///< a preset's name, or auto: what suits the data
  bool whole_frames = false;  ///< the old way: frames as they are, not moved
  bool box = true;            ///< edges of the data and letters of the patient's sides
  bool cut_open = false;      ///< what lies towards the eye is cut away, through what is touched
  bool hand = true;           ///< pen, proxy and force are drawn; off: it is only looked at
  /// The probe is a bare fingertip, which feels nothing: instead of a pen a ball, whose colour says
  /// whether it touches and, up to full_force_n, how hard. Then it stays where the surface holds
  /// it.
  bool fingertip = false;
  double full_force_n = 4.0;
};

/// The volumes that are felt, as they are to be seen: built anew when the scene changes (motion
/// arrived), then asked for a picture's scene at a time. Values; one thread.
class ScenePicture {
 public:
  explicit ScenePicture(const ViewChoices& choices) : choices_(choices) {}

  /// From the next update() on; another look comes with it.
  void choose(const ViewChoices& choices);
  /// Takes what is felt now. True if the renderer has to be given volumes() again.
  bool update(std::shared_ptr<const Scene> felt);
  /// The stream tubes that the hand has released, from the next at() on; may be null.
  void show(std::shared_ptr<const ReleasedTubes> tubes) { tubes_ = std::move(tubes); }
  /// At most four: the first ones that the scene shows.
  const std::vector<std::shared_ptr<const MovingVolume>>& volumes() const { return volumes_; }

  /// What is to be seen at display_ns (monotonic), from a tick not long before: volumes at the
  /// phase that the hand will feel then, where they are, with pen, proxy and force.
  ViewScene at(const SceneSnapshot& snapshot, int64_t display_ns, const Eye& eye);

  /// A box around all volumes at their places in `snapshot`, along the world's axes, m.
  void box(const SceneSnapshot& snapshot, glm::dvec3& low, glm::dvec3& high) const;
  /// A ball around the same, world, m.
  void bounds(const SceneSnapshot& snapshot, glm::dvec3& centre, double& radius_m) const;

 private:
  void add_things(const SceneSnapshot& snapshot, const Eye& eye, double radius_m, ViewScene& scene);
  void add_tubes(const ViewVolume& of, size_t v, double radius_m, Things& things) const;
  void add_hand(const SceneSnapshot& snapshot, const Eye& eye, double size, ViewScene& scene);
  const VolumeSpec& spec(size_t v) const { return felt_->volumes[shown_[v]].spec; }

  ViewChoices choices_;
  std::shared_ptr<const Scene> felt_;
  std::vector<size_t> shown_;  ///< which of the felt volumes volumes_ are
  std::vector<std::shared_ptr<const MovingVolume>> volumes_;
  std::vector<Look> looks_;  ///< empty: to be found anew
  std::shared_ptr<const ReleasedTubes> tubes_;
  std::vector<StreamLines> stream_;  ///< one per volume, whether or not it has tubes
};

/// kBadInput, naming the presets, if there is no look of that name.
Status check_look(const std::string& name);

/// The cut through what is touched (world, m) that this eye sees the face of: a plane across its
/// view, turned a little aside. What lies before it is cut away. It stays within the front half of
/// the ball around all volumes, so that it never takes all away, nor nothing.
ClipPlane cut_before(const Eye& eye, glm::dvec3 touched_m, glm::dvec3 centre_m, double radius_m);

/// An eye before a box (world, m), a little to the right and above, that just sees all of it.
Eye eye_before(glm::dvec3 low_m, glm::dvec3 high_m, PictureSize size);
/// The two eyes of a head there.
std::array<Eye, 2> eyes_before(glm::dvec3 low_m, glm::dvec3 high_m, PictureSize size);

}  // namespace palpate
