#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compute/volume/sequence_motion.h"
#include "module/scene/moving_volume.h"
#include "module/scene/scene_spec.h"
#include "tests/lab/report/plot.h"

namespace palpate::bench {

/// A place on a wall in frame 0. Volume space, m.
struct Place {
  glm::dvec3 at_m{0.0};
  /// Unit length, to the side of the wall on which the hand is.
  glm::dvec3 out{0.0};
  /// On the map of the wall: degrees about its axis, mm along it; on its picture: mm.
  double x = 0.0, y = 0.0;
};

/// A wall to press on: places, and the distance to the wall by which all ways of feeling it are
/// measured.
struct Wall {
  std::string name;  ///< "epicardium"
  /// Felt only by the way of this name, whose own surface it is; empty: by all.
  std::string only;
  std::string segment;  ///< of the carried volume; empty: there is none
  std::vector<Place> places;
  /// Signed distance to the wall in the motion's reference frame, mm, above 0 inside.
  std::shared_ptr<const FrameData> distance_mm;
  std::vector<glm::dvec3> surface_m;  ///< points all over it there, volume space
  /// The same to the contours of each frame, in the planes of the slices (empty: there are no drawn
  /// contours).
  std::vector<std::shared_ptr<const FrameData>> contours_mm;
  /// The wall in the motion's reference frame as the hand's side sees it; empty: it has a map only.
  std::optional<report::Backdrop> picture;
};

/// Where a hand means to be, as the simulated hand of `palpate feel` does: as far behind the place
/// all the time, whatever it feels there.
struct MeantPath {
  double depth_m = 0.014;
  double reach_m = 0.008;  ///< half a stroke, or a circle's radius
  double speed_m_per_s = 0.05;
};

/// One way to feel a subject.
struct Felt {
  std::string name;
  std::shared_ptr<const MovingVolume> volume;
  bool segments = false;  ///< the walls' segments, else the values
  TransferFunction strength;
  /// The program's own scene, in which the volume is scaled; empty: the wall alone, in its own
  /// size.
  std::optional<SceneSpec> spec;
  std::optional<MeantPath> path;  ///< empty: the hand leans on the wall with 1 N
};

/// A sequence with its walls and the ways to feel them.
struct Subject {
  std::string name;
  std::vector<Wall> walls;
  std::vector<Felt> felt;
  /// Gives the place of the material.
  std::shared_ptr<const SequenceMap> whole;
};

struct HeartsOptions {
  std::filesystem::path shared;  ///< folder with heart_cine/ and lung/
  /// Motions are stored here between runs; empty: not stored.
  std::filesystem::path keep;
  std::string preset = "balanced";
  int places = 32;  ///< on each wall
  /// Used instead of Otsu's value, unless it is 0.
  double level = 0.0;
};

/// Each throws studies::Mismatch with a message if something is missing or fails.
Subject beating_heart(const HeartsOptions& options);  ///< heart_cine with its labels
/// heart_cine as `palpate feel` feels it: without options, with the segmentation of each frame, and
/// with the scene docs/examples/heart.json. Each has the surface that is felt from outside as its
/// wall, scaled as on the simulated device, and the hand means to follow its paths. The first place
/// is the one that the program chooses.
Subject heart_as_felt(const HeartsOptions& options);
Subject breathing_lung(const HeartsOptions& options);  ///< lung/breathing.seq.nrrd
Subject heart_phantom_subject(const HeartsOptions& options);

/// The iso-surfaces of a file's first frame and their quality as walls, as lines of text.
std::string walls_in(const std::vector<std::filesystem::path>& inputs);

}  // namespace palpate::bench
