#pragma once

#include <cstdint>
#include <span>

namespace palpate::xr {

/// What a person can do with controllers and bare hands. The order is that of kActs.
enum class Act : uint8_t {
  kGrip,     ///< where the palm is
  kAim,      ///< where the controller points
  kPoke,     ///< where a bare hand's fingertip is
  kPinch,    ///< its thumb and finger touch
  kGrab,     ///< hold on to the volume
  kDeadMan,  ///< held: the force device may push
  kClip,     ///< held: the clip plane lies on this controller
  kPlayPause,
  kRecentre,
  kPresetNext,
  kPresetPrevious,
  kPanel,    ///< shows or hides the panel with text
  kScrub,    ///< -1 to 1
  kVibrate,  ///< output
  kCount
};

enum class ActKind : uint8_t { kPose, kButton, kAxis, kVibration };

struct ActSpec {
  Act act;
  const char* name;   ///< as OpenXR wants names: lower case
  const char* label;  ///< for people, in the runtime's menus
  ActKind kind;
  bool per_hand;  ///< left and right are told apart
};
std::span<const ActSpec> acts();

/// One line of the table: which part of a controller gives this act.
struct InputBinding {
  Act act;
  const char* path;
};
struct Profile {
  const char* path;
  std::span<const InputBinding> bindings;
  bool of_bare_hands = false;  ///< only with XR_EXT_hand_interaction
};
/// Simple, touch, vive, index and WMR controllers, and hands without one.
std::span<const Profile> profiles();

}  // namespace palpate::xr
