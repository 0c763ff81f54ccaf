#pragma once

#include <array>

#include "module/xr/bindings.h"
#include "module/xr/hands.h"
#include "module/xr/session.h"

namespace palpate::xr {

/// Seventh in the life cycle: the input of controllers, and of bare hands where the runtime gives
/// them as input (XR_EXT_hand_interaction). Made once per session, before it begins. Move-only.
class Actions {
 public:
  static Outcome<Actions> make(const Instance& instance, const OpenXrSession& session);

  /// Reads everything for the display time. Unfocused: at rest, without a call.
  Outcome<Hands> read(const OpenXrSession& session, XrSpace base, XrTime time,
                      const Pose& world_from_base);

  /// Starts a vibration, or stops what runs (amplitude 0).
  Done vibrate(const OpenXrSession& session, int hand, double amplitude, int64_t duration_ns);

  /// Asks again which controllers are in the hands: after XrEventDataInteractionProfileChanged.
  Done ask_profiles(const Instance& instance, const OpenXrSession& session);
  /// Whether the runtime gives a hand without a controller as input now.
  bool bare_hands() const;

 private:
  using Set = XrHandle<XrActionSet, xrDestroyActionSet>;
  using Space = XrHandle<XrSpace, xrDestroySpace>;

  Done make_actions(const Instance& instance);
  Done suggest(const Instance& instance);
  Done attach(const OpenXrSession& session);
  XrAction action(Act act) const { return actions_[size_t(act)]; }
  XrActionStateGetInfo about(Act act, XrPath hand) const;
  Outcome<XrActionStateBoolean> button(const OpenXrSession& session, Act act, XrPath hand) const;
  Done read_hand(const OpenXrSession& session, size_t side, XrSpace base, XrTime time,
                 const Pose& world_from_base, Controller& hand) const;
  Done read_fingers(const OpenXrSession& session, size_t side, XrSpace base, XrTime time,
                    const Pose& world_from_base, Fingers& fingers) const;
  Done read_buttons(const OpenXrSession& session, Hands& hands) const;

  Set set_;
  std::array<XrAction, size_t(Act::kCount)> actions_{};  ///< die with the set
  std::array<XrPath, 2> sides_{};
  std::array<Space, 2> grips_, aims_, pokes_;
  std::array<std::string, 2> profile_names_;
};

}  // namespace palpate::xr
