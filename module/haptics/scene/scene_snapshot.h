#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

#include "module/haptics/cause.h"
#include "module/scene/scene_spec.h"
#include "module/scene/transform.h"

namespace palpate {

/// Where a volume is in space and in its own time.
struct VolumeSnapshot {
  Transform world_from_volume;
  double time_s = 0.0;  ///< of the sequence
  double rate = 0.0;    ///< s per s, ramps included
};

/// The points of a tool that has several.
struct PointsSnapshot {
  int count = 0;                                      ///< 0: the tool is a point or a ball
  std::array<glm::dvec3, kMostToolPoints> proxies_m;  ///< world
};

/// A second hand's own haptic frame.
struct HandSnapshot {
  glm::dvec3 probe_m{0.0}, proxy_m{0.0}, shaft{0.0}, force_n{0.0};  ///< as in SceneSnapshot
  bool in_contact = false;
  PointsSnapshot points;
};

/// What a viewer needs to know of a haptic frame: plain data, handed over by value.
struct SceneSnapshot {
  static constexpr int kMostVolumes = 8;

  int64_t now_ns = 0;  ///< monotonic time of the tick
  int volume_count = 0;
  std::array<VolumeSnapshot, kMostVolumes> volumes;  ///< in the scene's order
  glm::dvec3 probe_m{0.0}, proxy_m{0.0};             ///< world
  /// World, unit: from the probe along the grip's shaft; zero: the device does not sense it.
  glm::dvec3 shaft{0.0};
  glm::dvec3 force_n{0.0};  ///< that reaches the hand, along the world's axes
  Cause cause = Cause::kStarting;
  bool in_contact = false;
  PointsSnapshot points;
  bool has_second = false;  ///< a second device feels the scene, too
  HandSnapshot second;
};

}  // namespace palpate
