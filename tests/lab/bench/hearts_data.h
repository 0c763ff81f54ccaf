#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "compute/volume/sequence_motion.h"
#include "module/scene/moving_volume.h"
#include "module/scene/scene_spec.h"

namespace palpate::bench {

/// A place on a wall as it is in frame 0. Volume space, m.
struct Place {
  glm::dvec3 at_m{0.0};
  glm::dvec3 out{0.0};      ///< unit length, away from what the wall holds the hand out of
  double x = 0.0, y = 0.0;  ///< on the map of the wall: degrees about its axis, mm along it
};

/// One thing to press on: places, and the distance to the wall that all ways of feeling it are
/// judged by.
struct Wall {
  std::string name;     ///< "epicardium"
  std::string only;     ///< felt by the way of this name alone, whose own surface it is; empty: all
  std::string segment;  ///< of the carried volume; empty: there is none
  std::vector<Place> places;
  /// Signed distance to the wall in the motion's reference frame, mm, above 0 inside.
  std::shared_ptr<const FrameData> distance_mm;
  std::vector<glm::dvec3> surface_m;  ///< points all over it there, volume space
  /// The same to the contours of each frame, in the planes of the slices (empty: not drawn by
  /// anybody).
  std::vector<std::shared_ptr<const FrameData>> contours_mm;
};

/// One way to feel a subject.
struct Felt {
  std::string name;
  std::shared_ptr<const MovingVolume> volume;
  bool segments = false;  ///< the walls' segments, else the values
  TransferFunction strength;
};

/// A sequence with its walls and the ways to feel them.
struct Subject {
  std::string name;
  std::vector<Wall> walls;
  std::vector<Felt> felt;
  std::shared_ptr<const SequenceMap> whole;  ///< tells where the material is
};

struct HeartsOptions {
  std::filesystem::path shared;  ///< folder with heart_cine/ and lung/
  std::filesystem::path keep;    ///< motions are kept here between runs; empty: not at all
  std::string preset = "balanced";
  int places = 32;     ///< on each wall
  double level = 0.0;  ///< felt instead of Otsu's value, where it is not 0
};

/// Each throws studies::Mismatch with a sentence if something is missing or fails.
Subject beating_heart(const HeartsOptions& options);   ///< heart_cine with its labels
Subject breathing_lung(const HeartsOptions& options);  ///< lung/breathing.seq.nrrd
Subject heart_phantom_subject(const HeartsOptions& options);

/// The surfaces of equal value of a file's first frame and what they are as walls, as lines of
/// text.
std::string walls_in(const std::vector<std::filesystem::path>& inputs);

}  // namespace palpate::bench
