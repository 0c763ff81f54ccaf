#pragma once

#include <string_view>

#include "integration/devices/scripted_path.h"

namespace palpate::devices {

/// Where the paths of the simulated hand take place. Space: the device's, m.
struct PathPlace {
  glm::dvec3 surface_m{0.0};          ///< a point of the surface that is touched
  glm::dvec3 outward{0.0, 1.0, 0.0};  ///< away from the material, any length > 0
  glm::dvec3 along{1.0, 0.0, 0.0};    ///< where strokes go; its part along the surface counts
  double clearance_m = 0.010;         ///< the hand starts and ends this far outside
  double depth_m = 0.010;             ///< the hand means to go this far inside
  double reach_m = 0.010;             ///< half a stroke, or a circle's radius
  double speed_m_per_s = 0.05;        ///< of every move
  double hold_s = 1.0;                ///< at the start, and in contact
  int times = 1;                      ///< so often
};

/// Goes in, holds, comes out.
ScriptedPath press_path(const PathPlace& place);
/// Short presses without a hold.
ScriptedPath tap_path(const PathPlace& place);
/// Goes in, strokes along to reach_m and back to -reach_m, comes out.
ScriptedPath stroke_path(const PathPlace& place);
/// Goes in, draws circles on the surface, comes out.
ScriptedPath circle_path(const PathPlace& place);
/// Straight through along -outward at even speed, from clearance_m outside to depth_m inside, and
/// back.
ScriptedPath sweep_path(const PathPlace& place);

/// "press", "tap", "stroke", "circle" or "sweep", else the file of that name. kBadInput if it is
/// neither.
Result<ScriptedPath> path_named(std::string_view name_or_file, const PathPlace& place);

}  // namespace palpate::devices
