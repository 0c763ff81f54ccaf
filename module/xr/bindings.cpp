#include "module/xr/bindings.h"

#include <array>

#include "module/xr/newer_openxr.h"

namespace palpate::xr {
namespace {

constexpr std::array kActs{
    ActSpec{Act::kGrip, "grip", "Hand", ActKind::kPose, true},
    ActSpec{Act::kAim, "aim", "Pointing", ActKind::kPose, true},
    ActSpec{Act::kPoke, "poke", "Fingertip", ActKind::kPose, true},
    ActSpec{Act::kPinch, "pinch", "Pinch to touch", ActKind::kButton, true},
    ActSpec{Act::kGrab, "grab", "Grab the volume", ActKind::kButton, true},
    ActSpec{Act::kDeadMan, "dead_man", "Hold to feel the force", ActKind::kButton, true},
    ActSpec{Act::kClip, "clip", "Hold to cut open", ActKind::kButton, true},
    ActSpec{Act::kPlayPause, "play_pause", "Play or pause", ActKind::kButton, false},
    ActSpec{Act::kRecentre, "recentre", "Bring the volume here", ActKind::kButton, false},
    ActSpec{Act::kPresetNext, "preset_next", "Next look", ActKind::kButton, false},
    ActSpec{Act::kPresetPrevious, "preset_previous", "Former look", ActKind::kButton, false},
    ActSpec{Act::kPanel, "panel", "Show or hide the text", ActKind::kButton, false},
    ActSpec{Act::kScrub, "scrub", "Move through time", ActKind::kAxis, false},
    ActSpec{Act::kVibrate, "vibrate", "Force as vibration", ActKind::kVibration, true}};
static_assert(kActs.size() == size_t(Act::kCount));

#define PALPATE_BOTH(act, part)                              \
  InputBinding{act, "/user/hand/left/" part}, InputBinding { \
    act, "/user/hand/right/" part                            \
  }
#define PALPATE_HELD                                                                      \
  PALPATE_BOTH(Act::kGrip, "input/grip/pose"), PALPATE_BOTH(Act::kAim, "input/aim/pose"), \
      PALPATE_BOTH(Act::kVibrate, "output/haptic")

// Two buttons only: the volume is grabbed with either hand, the dead-man is the other button of the
// right one.
constexpr std::array kSimple{PALPATE_HELD, PALPATE_BOTH(Act::kGrab, "input/select/click"),
                             InputBinding{Act::kPlayPause, "/user/hand/left/input/menu/click"},
                             InputBinding{Act::kDeadMan, "/user/hand/right/input/menu/click"}};

constexpr std::array kTouch{PALPATE_HELD,
                            PALPATE_BOTH(Act::kGrab, "input/squeeze/value"),
                            PALPATE_BOTH(Act::kDeadMan, "input/trigger/value"),
                            PALPATE_BOTH(Act::kClip, "input/thumbstick/click"),
                            InputBinding{Act::kPlayPause, "/user/hand/right/input/a/click"},
                            InputBinding{Act::kRecentre, "/user/hand/right/input/b/click"},
                            InputBinding{Act::kPresetNext, "/user/hand/left/input/y/click"},
                            InputBinding{Act::kPresetPrevious, "/user/hand/left/input/x/click"},
                            InputBinding{Act::kPanel, "/user/hand/left/input/menu/click"},
                            InputBinding{Act::kScrub, "/user/hand/right/input/thumbstick/x"}};

constexpr std::array kVive{PALPATE_HELD,
                           PALPATE_BOTH(Act::kGrab, "input/squeeze/click"),
                           PALPATE_BOTH(Act::kDeadMan, "input/trigger/value"),
                           InputBinding{Act::kClip, "/user/hand/right/input/trackpad/click"},
                           InputBinding{Act::kPlayPause, "/user/hand/right/input/menu/click"},
                           InputBinding{Act::kRecentre, "/user/hand/left/input/menu/click"},
                           InputBinding{Act::kPresetNext, "/user/hand/left/input/trackpad/click"},
                           InputBinding{Act::kScrub, "/user/hand/left/input/trackpad/x"}};

constexpr std::array kIndex{PALPATE_HELD,
                            PALPATE_BOTH(Act::kGrab, "input/squeeze/value"),
                            PALPATE_BOTH(Act::kDeadMan, "input/trigger/value"),
                            PALPATE_BOTH(Act::kClip, "input/thumbstick/click"),
                            InputBinding{Act::kPlayPause, "/user/hand/right/input/a/click"},
                            InputBinding{Act::kRecentre, "/user/hand/right/input/b/click"},
                            InputBinding{Act::kPresetNext, "/user/hand/left/input/b/click"},
                            InputBinding{Act::kPresetPrevious, "/user/hand/left/input/a/click"},
                            InputBinding{Act::kPanel, "/user/hand/left/input/trackpad/force"},
                            InputBinding{Act::kScrub, "/user/hand/right/input/thumbstick/x"}};

constexpr std::array kMixedReality{
    PALPATE_HELD,
    PALPATE_BOTH(Act::kGrab, "input/squeeze/click"),
    PALPATE_BOTH(Act::kDeadMan, "input/trigger/value"),
    PALPATE_BOTH(Act::kClip, "input/thumbstick/click"),
    InputBinding{Act::kPlayPause, "/user/hand/right/input/menu/click"},
    InputBinding{Act::kRecentre, "/user/hand/left/input/menu/click"},
    InputBinding{Act::kPresetNext, "/user/hand/right/input/trackpad/click"},
    InputBinding{Act::kPresetPrevious, "/user/hand/left/input/trackpad/click"},
    InputBinding{Act::kScrub, "/user/hand/right/input/thumbstick/x"}};

// A value used as a button: the runtime says when the fingers touch, with its own hysteresis.
constexpr std::array kBareHands{PALPATE_BOTH(Act::kPoke, "input/poke_ext/pose"),
                                PALPATE_BOTH(Act::kPinch, "input/pinch_ext/value")};
#undef PALPATE_HELD
#undef PALPATE_BOTH

constexpr std::array kProfiles{
    Profile{"/interaction_profiles/khr/simple_controller", kSimple},
    Profile{"/interaction_profiles/oculus/touch_controller", kTouch},
    Profile{"/interaction_profiles/htc/vive_controller", kVive},
    Profile{"/interaction_profiles/valve/index_controller", kIndex},
    Profile{"/interaction_profiles/microsoft/motion_controller", kMixedReality},
    Profile{kHandInteractionProfile, kBareHands, true}};

}  // namespace

std::span<const ActSpec> acts() {
  return kActs;
}

std::span<const Profile> profiles() {
  return kProfiles;
}

}  // namespace palpate::xr
