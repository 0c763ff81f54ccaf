#include "module/xr/actions.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "module/xr/newer_openxr.h"
#include "module/xr/spaces.h"

namespace palpate::xr {
namespace {

XrActionType type_of(ActKind kind) {
  switch (kind) {
    case ActKind::kPose:
      return XR_ACTION_TYPE_POSE_INPUT;
    case ActKind::kAxis:
      return XR_ACTION_TYPE_FLOAT_INPUT;
    case ActKind::kVibration:
      return XR_ACTION_TYPE_VIBRATION_OUTPUT;
    default:
      return XR_ACTION_TYPE_BOOLEAN_INPUT;
  }
}

/// Copies into a fixed field of OpenXR; every one that is used has room for the text and its end.
template <size_t n>
void set_text(char (&field)[n], const char* text) {
  std::strncpy(field, text, n - 1);
  field[n - 1] = 0;
}

}  // namespace

Outcome<Actions> Actions::make(const Instance& instance, const OpenXrSession& session) {
  Actions made;
  Done done = made.make_actions(instance);
  if (done) done = made.suggest(instance);
  if (done) done = made.attach(session);
  if (!done) return done.error();
  return made;
}

Done Actions::make_actions(const Instance& instance) {
  constexpr std::array kSides{"/user/hand/left", "/user/hand/right"};
  for (size_t side = 0; side < 2; ++side) {
    const Outcome<XrPath> path = instance.path(kSides[side]);
    if (!path) return path.error();
    sides_[side] = *path;
  }
  XrActionSetCreateInfo set{XR_TYPE_ACTION_SET_CREATE_INFO};
  set_text(set.actionSetName, "palpate");
  set_text(set.localizedActionSetName, "palpate");
  Done made = done("xrCreateActionSet", xrCreateActionSet(instance.handle(), &set, set_.out()));
  if (!made) return made;
  for (const ActSpec& spec : acts()) {
    XrActionCreateInfo create{XR_TYPE_ACTION_CREATE_INFO};
    set_text(create.actionName, spec.name);
    set_text(create.localizedActionName, spec.label);
    create.actionType = type_of(spec.kind);
    if (spec.per_hand) {
      create.countSubactionPaths = uint32_t(sides_.size());
      create.subactionPaths = sides_.data();
    }
    made = done("xrCreateAction", xrCreateAction(set_.get(), &create, &actions_[size_t(spec.act)]));
    if (!made) return made;
  }
  return Nothing{};
}

Done Actions::suggest(const Instance& instance) {
  for (const Profile& profile : profiles()) {
    if (profile.of_bare_hands && !instance.has_hand_interaction()) continue;
    const Outcome<XrPath> path = instance.path(profile.path);
    if (!path) return path.error();
    std::vector<XrActionSuggestedBinding> bindings;
    for (const InputBinding& binding : profile.bindings) {
      const Outcome<XrPath> part = instance.path(binding.path);
      if (!part) return part.error();
      bindings.push_back({action(binding.act), *part});
    }
    XrInteractionProfileSuggestedBinding suggested{XR_TYPE_INTERACTION_PROFILE_SUGGESTED_BINDING};
    suggested.interactionProfile = *path;
    suggested.countSuggestedBindings = uint32_t(bindings.size());
    suggested.suggestedBindings = bindings.data();
    const XrResult result = xrSuggestInteractionProfileBindings(instance.handle(), &suggested);
    // A runtime that does not know one kind of controller still knows others.
    if (result == XR_ERROR_PATH_UNSUPPORTED) continue;
    if (XR_FAILED(result)) return problem_of("xrSuggestInteractionProfileBindings", result);
  }
  return Nothing{};
}

Done Actions::attach(const OpenXrSession& session) {
  const XrActionSet set = set_.get();
  XrSessionActionSetsAttachInfo attach{XR_TYPE_SESSION_ACTION_SETS_ATTACH_INFO};
  attach.countActionSets = 1;
  attach.actionSets = &set;
  Done made =
      done("xrAttachSessionActionSets", xrAttachSessionActionSets(session.handle(), &attach));
  for (size_t side = 0; side < 2; ++side) {
    for (const auto& [act, spaces] :
         {std::pair(Act::kGrip, &grips_), {Act::kAim, &aims_}, {Act::kPoke, &pokes_}}) {
      if (!made) return made;
      XrActionSpaceCreateInfo create{XR_TYPE_ACTION_SPACE_CREATE_INFO};
      create.action = action(act);
      create.subactionPath = sides_[side];
      create.poseInActionSpace = identity_pose();
      made = done("xrCreateActionSpace",
                  xrCreateActionSpace(session.handle(), &create, (*spaces)[side].out()));
    }
  }
  return made;
}

XrActionStateGetInfo Actions::about(Act act, XrPath hand) const {
  XrActionStateGetInfo get{XR_TYPE_ACTION_STATE_GET_INFO};
  get.action = action(act);
  get.subactionPath = hand;
  return get;
}

Outcome<XrActionStateBoolean> Actions::button(const OpenXrSession& session, Act act,
                                              XrPath hand) const {
  const XrActionStateGetInfo get = about(act, hand);
  XrActionStateBoolean state{XR_TYPE_ACTION_STATE_BOOLEAN};
  const XrResult result = xrGetActionStateBoolean(session.handle(), &get, &state);
  if (XR_FAILED(result)) return problem_of("xrGetActionStateBoolean", result);
  // What is not active is not pressed, whatever the runtime left in the field.
  if (!state.isActive) state.currentState = state.changedSinceLastSync = XR_FALSE;
  return state;
}

Outcome<Hands> Actions::read(const OpenXrSession& session, XrSpace base, XrTime time,
                             const Pose& world_from_base) {
  Hands hands;
  if (!session.life().focused()) return hands;
  const XrActiveActionSet active{set_.get(), XR_NULL_PATH};
  XrActionsSyncInfo sync{XR_TYPE_ACTIONS_SYNC_INFO};
  sync.countActiveActionSets = 1;
  sync.activeActionSets = &active;
  const XrResult synced = xrSyncActions(session.handle(), &sync);
  if (XR_FAILED(synced)) return problem_of("xrSyncActions", synced);
  // The runtime has taken the focus away, but its event has not arrived yet.
  if (synced == XR_SESSION_NOT_FOCUSED) return hands;
  hands.focused = true;
  Done done = read_buttons(session, hands);
  for (size_t side = 0; side < 2 && done; ++side) {
    done = read_hand(session, side, base, time, world_from_base, hands.hand[side]);
    if (done) done = read_fingers(session, side, base, time, world_from_base, hands.fingers[side]);
  }
  if (!done) return done.error();
  return hands;
}

Done Actions::read_hand(const OpenXrSession& session, size_t side, XrSpace base, XrTime time,
                        const Pose& world_from_base, Controller& hand) const {
  const auto held = [&](Act act, bool& into) -> Done {
    const auto state = button(session, act, sides_[side]);
    if (!state) return state.error();
    into = state->currentState == XR_TRUE;
    return Nothing{};
  };
  hand.profile = profile_names_[side];
  const XrActionStateGetInfo get = about(Act::kGrip, sides_[side]);
  XrActionStatePose pose{XR_TYPE_ACTION_STATE_POSE};
  Done read = done("xrGetActionStatePose", xrGetActionStatePose(session.handle(), &get, &pose));
  if (!read) return read;
  if (pose.isActive) {
    glm::dvec3 velocity{0.0};
    const auto grip = locate(grips_[side].get(), base, time, &velocity);
    if (!grip) return grip.error();
    const auto aim = locate(aims_[side].get(), base, time);
    if (!aim) return aim.error();
    if (*grip) {
      hand.active = true;
      hand.world_from_grip = world_from_base * **grip;
      hand.velocity_m_per_s = world_from_base.rotation * velocity;
    }
    if (*aim) hand.world_from_aim = world_from_base * **aim;
  }
  // The dead-man first: without it, nothing else that is read matters.
  read = held(Act::kDeadMan, hand.dead_man);
  if (read) read = held(Act::kGrab, hand.grabs);
  if (read) read = held(Act::kClip, hand.clip);
  return read;
}

/// A fingertip that the runtime guesses is not seen: a hand that has left the cameras must not go
/// on touching.
Done Actions::read_fingers(const OpenXrSession& session, size_t side, XrSpace base, XrTime time,
                           const Pose& world_from_base, Fingers& fingers) const {
  const XrActionStateGetInfo get = about(Act::kPoke, sides_[side]);
  XrActionStatePose pose{XR_TYPE_ACTION_STATE_POSE};
  const Done read =
      done("xrGetActionStatePose", xrGetActionStatePose(session.handle(), &get, &pose));
  if (!read || !pose.isActive) return read;
  const auto tip = locate(pokes_[side].get(), base, time, nullptr, true);
  if (!tip) return tip.error();
  const auto pinch = button(session, Act::kPinch, sides_[side]);
  if (!pinch) return pinch.error();
  if (!*tip || !std::isfinite(glm::length((*tip)->position_m))) return Nothing{};
  fingers.seen = true;
  fingers.fingertip_m = world_from_base((*tip)->position_m);
  fingers.pinches = pinch->currentState == XR_TRUE;
  return Nothing{};
}

Done Actions::read_buttons(const OpenXrSession& session, Hands& hands) const {
  Done read = Nothing{};
  const auto pressed = [&](Act act) {
    if (!read) return false;
    const auto state = button(session, act, XR_NULL_PATH);
    if (!state) {
      read = state.error();
      return false;
    }
    return state->currentState && state->changedSinceLastSync;
  };
  hands.play_pause = pressed(Act::kPlayPause);
  hands.recentre = pressed(Act::kRecentre);
  hands.panel = pressed(Act::kPanel);
  hands.preset_steps = int(pressed(Act::kPresetNext)) - int(pressed(Act::kPresetPrevious));
  if (!read) return read;
  const XrActionStateGetInfo get = about(Act::kScrub, XR_NULL_PATH);
  XrActionStateFloat scrub{XR_TYPE_ACTION_STATE_FLOAT};
  read = done("xrGetActionStateFloat", xrGetActionStateFloat(session.handle(), &get, &scrub));
  if (read && scrub.isActive) hands.scrub = std::clamp(double(scrub.currentState), -1.0, 1.0);
  return read;
}

Done Actions::vibrate(const OpenXrSession& session, int hand, double amplitude,
                      int64_t duration_ns) {
  XrHapticActionInfo info{XR_TYPE_HAPTIC_ACTION_INFO};
  info.action = action(Act::kVibrate);
  info.subactionPath = sides_[size_t(hand)];
  if (!(amplitude > 0.0))
    return done("xrStopHapticFeedback", xrStopHapticFeedback(session.handle(), &info));
  XrHapticVibration vibration{XR_TYPE_HAPTIC_VIBRATION};
  vibration.amplitude = float(std::min(amplitude, 1.0));
  vibration.duration = duration_ns;
  vibration.frequency = XR_FREQUENCY_UNSPECIFIED;
  return done("xrApplyHapticFeedback",
              xrApplyHapticFeedback(session.handle(), &info,
                                    reinterpret_cast<XrHapticBaseHeader*>(&vibration)));
}

Done Actions::ask_profiles(const Instance& instance, const OpenXrSession& session) {
  for (size_t side = 0; side < 2; ++side) {
    XrInteractionProfileState state{XR_TYPE_INTERACTION_PROFILE_STATE};
    Done asked = done("xrGetCurrentInteractionProfile",
                      xrGetCurrentInteractionProfile(session.handle(), sides_[side], &state));
    if (!asked) return asked;
    profile_names_[side].clear();
    if (state.interactionProfile == XR_NULL_PATH) continue;
    char text[XR_MAX_PATH_LENGTH] = {};
    uint32_t length = 0;
    asked = done("xrPathToString", xrPathToString(instance.handle(), state.interactionProfile,
                                                  uint32_t(sizeof text), &length, text));
    if (!asked) return asked;
    profile_names_[side] = text;
  }
  return Nothing{};
}

bool Actions::bare_hands() const {
  return std::find(profile_names_.begin(), profile_names_.end(), kHandInteractionProfile) !=
         profile_names_.end();
}

}  // namespace palpate::xr
