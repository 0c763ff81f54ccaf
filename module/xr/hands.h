#pragma once

#include <array>
#include <optional>
#include <string>

#include "module/xr/pose.h"

namespace palpate::xr {

/// One controller at the predicted display time.
struct Controller {
  bool active = false;                 ///< a controller is there and tells where it is
  Pose world_from_grip;                ///< the palm; valid if active
  std::optional<Pose> world_from_aim;  ///< where it points
  glm::dvec3 velocity_m_per_s{0.0};    ///< of the grip, world; 0 where it is not known
  bool grabs = false;                  ///< holds on to the volume
  bool dead_man = false;               ///< holds the button without which a force device stays limp
  bool clip = false;                   ///< holds the clip plane on this controller
  std::string profile;                 ///< the controller's interaction profile; empty: none
};

/// A hand without a controller that the headset sees, at the predicted display time: by the
/// runtime's own poses and pinch (XR_EXT_hand_interaction), or else by the hand's joints.
struct Fingers {
  bool seen = false;            ///< thumb and forefinger are
  glm::dvec3 fingertip_m{0.0};  ///< of the forefinger, world; valid if seen
  bool pinches = false;         ///< thumb and forefinger touch
};

/// Everything the person did since the frame before. While the session is not focused all of it is
/// at rest: nothing is grabbed, no dead-man is held.
struct Hands {
  std::array<Controller, 2> hand;  ///< left, right
  std::array<Fingers, 2> fingers;  ///< likewise; runtimes may see a hand that holds a controller
  bool play_pause = false;         ///< was pressed since the last frame
  bool recentre = false;           ///< was pressed since the last frame
  bool panel = false;              ///< was pressed since the last frame
  int preset_steps = 0;            ///< to the next (+) or the one before (-) since the last frame
  double scrub = 0.0;              ///< -1 to 1: how fast to move through the sequence
  bool focused = false;            ///< the runtime gives input to this program now
};

}  // namespace palpate::xr
