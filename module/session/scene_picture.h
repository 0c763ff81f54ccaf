#pragma once

#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "compute/vulkan/context.h"
#include "module/haptics/scene/scene.h"
#include "module/haptics/scene/scene_snapshot.h"
#include "module/session/hand_tubes.h"
#include "module/session/slices.h"
#include "module/view/stereo.h"
#include "module/view/stream_lines.h"
#include "module/view/view_scene.h"
#include "module/view/volume_renderer.h"

namespace palpate {

/// What is behind a picture's volumes. kNone: nothing, so that pictures in files are transparent
/// there; where that is not possible it is kDark.
enum class PictureBackground : uint8_t { kDark, kLight, kNone };

/// Where a picture is seen from; not set: a little from the right and above.
struct SeenFrom {
  std::optional<double> azimuth_deg;    ///< 0: the patient's front; 90: the patient's left
  std::optional<double> elevation_deg;  ///< above the horizon, -89 to 89
  double zoom = 1.0;                    ///< 2: twice as large
  bool operator==(const SeenFrom&) const = default;
};

/// What a viewer can change.
struct ViewChoices {
  std::string look = "auto";  ///< a preset's name, or auto: what suits the data
  /// Middle and width of the values that the look is spread over, as in every viewer of slices; not
  /// set: the look's own.
  std::optional<double> level, width;
  /// The same, moved by hand: the middle by so many widths, the width by this factor.
  double level_moved = 0.0, width_factor = 1.0;
  bool whole_frames = false;       ///< for comparison: frames as they are, not moved between them
  bool box = true;                 ///< edges of the data, and letters for the patient's sides
  bool slices = true;              ///< three slices beside the picture, where there is room
  glm::dvec3 slices_moved_m{0.0};  ///< without a hand: their place from the middle, world
  bool cut_open = false;  ///< cut away what lies between the eye and the place that is touched
  bool hand = true;       ///< draw pen, proxy and force; false: viewing only
  /// The probe is a bare fingertip without force feedback: instead of a pen a ball is drawn. Its
  /// colour shows whether it touches and, up to full_force_n, how hard; in contact it stays at the
  /// surface.
  bool fingertip = false;
  double full_force_n = 4.0;
  PictureBackground background = PictureBackground::kDark;
  double shadows = 1.0;  ///< see ViewScene::shadows
  int averaged = 1;      ///< so many pictures make one in a file, see picture_mean.h
  SeenFrom from;
  /// How two eyes are put together; not set: one eye in a window, both side by side in files for
  /// two eyes. Not for headsets.
  std::optional<Stereo> stereo;
  bool operator==(const ViewChoices&) const = default;
};

/// Makes pictures' scenes from the volumes that are felt. It is rebuilt when the scene changes
/// (motion arrived). Values; one thread.
class ScenePicture {
 public:
  explicit ScenePicture(const ViewChoices& choices) : choices_(choices) {}

  /// Takes effect with the next update(); another look does, too.
  void choose(const ViewChoices& choices);
  const ViewChoices& choices() const { return choices_; }
  /// Takes the present scene. True if the renderer must be given volumes() again.
  bool update(std::shared_ptr<const Scene> felt);
  /// The stream tubes that the user has released, from the next at() on; may be null.
  void show(std::shared_ptr<const ReleasedTubes> tubes) { tubes_ = std::move(tubes); }
  /// At most four: the first visible volumes of the scene.
  const std::vector<std::shared_ptr<const MovingVolume>>& volumes() const { return volumes_; }

  /// The scene to draw for display_ns (monotonic), from a tick shortly before: volumes at the phase
  /// that the hand will feel at that time and at their places, with pen, proxy and force. eyes:
  /// that see it, one or more; what turns to the eye turns to the first.
  ViewScene at(const SceneSnapshot& snapshot, int64_t display_ns, std::span<const Eye> eyes);

  /// kBadInput with a sentence if there are volumes and nothing of them would be seen: their looks
  /// show none of their values, and there are no segments and no tubes. After update().
  Status shows_something() const;

  /// Slices through the first visible volume at the time of the tick: at the place that is touched,
  /// or without a hand in the middle of its segments, else of the data. Contours are those of the
  /// visible segments, and with a hand of the iso-surfaces that it feels. None without volumes.
  /// After update().
  std::optional<OrthogonalSlices> slices(const SceneSnapshot& snapshot, int edge_px) const;

  /// The corners of the boxes of all volumes that are felt, eight for each, at their places in
  /// `snapshot`, world, m.
  std::vector<glm::dvec3> corners(const SceneSnapshot& snapshot) const;
  /// A sphere around them, world, m.
  void bounds(const SceneSnapshot& snapshot, glm::dvec3& centre, double& radius_m) const;

 private:
  void add_things(const SceneSnapshot& snapshot, std::span<const Eye> eyes, double radius_m,
                  ViewScene& scene);
  void add_tubes(size_t v, double radius_m, ViewScene& scene) const;
  void add_hand(const SceneSnapshot& snapshot, const Eye& eye, double size, ViewScene& scene);
  void add_drop_line(const SceneSnapshot& snapshot, double size, ViewScene& scene) const;
  /// What is felt of the first visible volume, or drawn as segments.
  std::vector<SliceWall> walls() const;
  /// How far straight below a place (world, m) the first of these walls is, up to most_m; not set:
  /// there is none.
  std::optional<double> height_m(const SceneSnapshot& snapshot, glm::dvec3 at_m,
                                 double most_m) const;
  /// No level and no width were chosen.
  bool has_own_window() const;
  /// Its axes are a patient's.
  bool has_patient(size_t v) const;
  /// The look of a volume with the choices of level and width.
  Look look_of(size_t v) const;
  /// The values that slices show black and white.
  glm::dvec2 greys_of(size_t v) const;
  const VolumeSpec& spec(size_t v) const { return felt_->volumes[shown_[v]].spec; }

  ViewChoices choices_;
  std::shared_ptr<const Scene> felt_;
  std::vector<size_t> shown_;  ///< indices of volumes_ in the scene
  std::vector<std::shared_ptr<const MovingVolume>> volumes_;
  /// When the last picture was made, and from when on each volume is on the way to a better motion:
  /// monotonic.
  static constexpr int64_t kLongAgo = std::numeric_limits<int64_t>::min();
  int64_t last_ns_ = kLongAgo;
  std::vector<int64_t> better_since_ns_;
  std::vector<Look> looks_;        ///< empty: to be chosen again
  std::vector<glm::dvec2> greys_;  ///< black and white of each volume's slices
  std::shared_ptr<const ReleasedTubes> tubes_;
  std::vector<StreamLines> stream_;  ///< one per volume, with or without tubes
};

/// Errors: kBadInput, with the names of the presets, if there is no look of that name.
Status check_look(const std::string& name);

/// The plane that cuts the scene open for this eye at the place that is touched (world, m): across
/// the view, rotated a little to the side. Everything in front of it is cut away. It stays within
/// the front half of the sphere around all volumes, so that it removes neither everything nor
/// nothing.
ClipPlane cut_before(const Eye& eye, glm::dvec3 touched_m, glm::dvec3 centre_m, double radius_m);

/// The azimuth of a picture for which none is chosen, degrees.
double usual_azimuth_deg();

/// The middle of the box along the world's axes around some places, m; 0 without any.
glm::dvec3 middle_of(std::span<const glm::dvec3> corners_m);
/// An eye in front of boxes, given by all their corners (world, m), from which, without zoom, all
/// of them is just visible.
Eye eye_before(std::span<const glm::dvec3> corners_m, PictureSize size, const SeenFrom& from = {});
/// The two eyes of a head in the place of this eye, which looks at something at this distance: both
/// frame the same there.
std::array<Eye, 2> eyes_of_head(const Eye& middle, double distance_m);
/// The two eyes of a head in the place of eye_before().
std::array<Eye, 2> eyes_before(std::span<const glm::dvec3> corners_m, PictureSize size,
                               const SeenFrom& from = {});

}  // namespace palpate
