#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "module/scene/look.h"
#include "module/scene/moving_volume.h"
#include "module/scene/transform.h"
#include "module/view/mesh.h"
#include "module/view/things.h"

namespace palpate {

/// A volume as it is to be drawn now.
struct ViewVolume {
  std::shared_ptr<const MovingVolume> data;  ///< one that was given to set_volumes
  Transform world_from_volume;
  FramePointer pointer;  ///< as the hand's playback has it, for the time of display
  Look look;
  int motion = 0;  ///< which of the volume's motions moves the picture
  /// On the way from data->whole_before to data->whole: the share of the latter, 0 to 1. Only where
  /// the former was shown before; else it counts as 1.
  double whole_share = 1.0;
  bool blend_values = true;   ///< equation (24); off: the frame's own values are carried
  bool whole_frames = false;  ///< for comparison: the frame that the pointer is in, not moved
  /// Share of the light that the surface of each of the data's segments takes where it is met at a
  /// right angle, 0 (not drawn) to 0.99. Surfaces stand in their segments' colours, are carried as
  /// the values are, and are cut as they are. At most 8 volumes and segments are drawn at once.
  double segment_opacity = 0.0;
  bool operator==(const ViewVolume&) const = default;
};

/// Kept is where dot(normal, x) >= offset_m.
struct ClipPlane {
  glm::dvec3 normal{1.0, 0.0, 0.0};  ///< world, unit length
  double offset_m = 0.0;
  bool operator==(const ClipPlane&) const = default;
};

/// The six planes of a box: what is inside is kept. low and high in the box's own axes, m.
std::vector<ClipPlane> clip_box(const Transform& world_from_box, glm::dvec3 low_m,
                                glm::dvec3 high_m);

/// Everything that one picture shows. Values; nothing refers to the renderer.
struct ViewScene {
  std::vector<ViewVolume> volumes;        ///< at most 4
  std::vector<RoundCone> things;          ///< opaque, world; see things.h
  std::vector<PlacedMesh> meshes;         ///< opaque; like things in all that follows
  std::vector<ClipPlane> clips;           ///< at most 8, all hold; they clip volumes, not things
  std::vector<TubeColours> tube_colours;  ///< of things; the renderer does not read them
  /// A gradient from the top to the bottom of the first eye's picture; other eyes continue it.
  glm::dvec3 background_top{0.105, 0.125, 0.16};    ///< sRGB
  glm::dvec3 background_bottom{0.03, 0.035, 0.05};  ///< sRGB
  glm::dvec3 light{-0.35, 0.65, 0.67};              ///< towards the light, in the first eye's axes
  /// Share of the light that tissue in between can take from a place, 0 (none) to 1: ambient
  /// occlusion and soft shadows. Things neither cast shadows nor lie in them.
  double shadows = 0.0;
  /// How far all samples along rays are moved, in their steps, 0 to 1: for pictures of one scene
  /// whose mean is taken (picture_mean.h).
  double samples_moved = 0.0;
  /// The same data, shown in the same way.
  bool operator==(const ViewScene&) const = default;
};

}  // namespace palpate
