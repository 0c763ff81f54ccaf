#pragma once

#include <optional>
#include <string>

#include "integration/headset/headset_event.h"
#include "integration/headset/touch_taker.h"
#include "module/xr/colocation.h"

namespace palpate::headset {

/// Checks that the picture stands at the force device: asks for one touched point after the start
/// and after every restart of the runtime, which may have moved the room's origin. One thread.
class PlaceCheck {
 public:
  /// controller_from_tip_m: as calibrated.
  explicit PlaceCheck(glm::dvec3 controller_from_tip_m);

  /// Once per frame; probe_m: the device's tip, world. A grab close to the tip is a touch, and is
  /// removed from the hands. Returns what the user is told, or nothing.
  std::optional<HeadsetEvent> step(double now_s, glm::dvec3 probe_m, xr::Colocation& room,
                                   xr::Hands& hands);

 private:
  HeadsetEvent judge(const TouchedPoint& point, xr::Colocation& room);

  glm::dvec3 tip_m_;
  std::array<TouchTaker, 2> takers_;
  bool wanted_ = true, asked_ = false;
};

}  // namespace palpate::headset
