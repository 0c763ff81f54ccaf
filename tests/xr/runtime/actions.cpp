// Action sets, bindings, input and vibration.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "tests/xr/runtime/profiles.h"
#include "tests/xr/runtime/world.h"

namespace palpate::test::fake {
namespace {

XrInstance instance_of(XrActionSet handle) {
  const std::lock_guard lock(world().mutex);
  const auto* set = world().find<ActionSet>(Kind::kActionSet, id_of(handle));
  return set ? handle_of<XrInstance>(set->parent) : XR_NULL_HANDLE;
}

XrInstance instance_of(XrAction handle) {
  const std::lock_guard lock(world().mutex);
  const auto* action = world().find<Action>(Kind::kAction, id_of(handle));
  return action ? instance_of(handle_of<XrActionSet>(action->parent)) : XR_NULL_HANDLE;
}

bool legal_name(const char* text) {
  if (!text[0]) return false;
  for (; *text; ++text) {
    const bool fine = (*text >= 'a' && *text <= 'z') || (*text >= '0' && *text <= '9') ||
                      *text == '-' || *text == '_' || *text == '.';
    if (!fine) return false;
  }
  return true;
}

const std::string& path_text(XrPath path) {
  static const std::string none;
  const World& w = world();
  return path == 0 || path > w.paths.size() ? none : w.paths[path - 1];
}

int side_of(const std::string& path) {
  return path.rfind("/user/hand/left", 0) == 0 ? 0 : 1;
}

/// 0: the fingers are 30 mm apart or more; 1: they touch, or nearly so.
float pinch_of(const SeenFingers& seen) {
  const XrVector3f &a = seen.thumb_tip, &b = seen.index_tip;
  const float gap = std::hypot(a.x - b.x, a.y - b.y, a.z - b.z) - 2 * seen.radius;
  return std::clamp(1 - (gap - 0.005F) / 0.025F, 0.0F, 1.0F);
}

float largest(const std::map<std::string, float>& input, const std::vector<std::string>& parts) {
  float value = 0;
  for (const std::string& part : parts) {
    const auto at = input.find(part);
    if (at != input.end() && std::abs(at->second) > std::abs(value)) value = at->second;
  }
  return value;
}

struct Asked {
  std::optional<XrResult> bad;
  bool active = false;
  float value = 0, before = 0;
};

Asked ask(const Call& call, const char* function, const XrActionStateGetInfo* get,
          XrActionType type) {
  if (call.answered()) return {call.answer()};
  World& w = world();
  const auto* action = w.find<Action>(Kind::kAction, id_of(get->action));
  if (!action) return {w.violation(std::string(function) + ": action", XR_ERROR_HANDLE_INVALID)};
  if (action->type != type)
    return {w.violation(std::string(function) + ": type", XR_ERROR_ACTION_TYPE_MISMATCH)};
  const auto& sets = call.session->attached;
  if (std::find(sets.begin(), sets.end(), action->parent) == sets.end())
    return {w.violation(std::string(function) + ": attached", XR_ERROR_ACTIONSET_NOT_ATTACHED)};
  const auto& hands = action->hands;
  if (get->subactionPath &&
      std::find(hands.begin(), hands.end(), get->subactionPath) == hands.end())
    return {w.violation(std::string(function) + ": subaction", XR_ERROR_PATH_UNSUPPORTED)};
  Asked asked;
  const auto parts = bound_parts(*action, get->subactionPath);
  asked.active =
      call.session->synced && call.session->state == XR_SESSION_STATE_FOCUSED && !parts.empty();
  if (!asked.active) return asked;
  asked.value = largest(call.session->input, parts);
  asked.before = largest(call.session->input_before, parts);
  return asked;
}

}  // namespace

std::vector<std::string> bound_parts(const Action& action, XrPath hand) {
  World& w = world();
  std::vector<std::string> parts;
  const Instance* instance = nullptr;
  for (const auto& [id, object] : w.objects)
    if (object->kind == Kind::kInstance) instance = static_cast<Instance*>(object.get());
  const std::string now[2] = {w.profile_of(0), w.profile_of(1)};
  for (const auto& [profile, lines] : instance->suggested) {
    for (const auto& [id, path] : lines) {
      if (id != action.id) continue;
      const std::string& part = path_text(path);
      if (hand && part.rfind(path_text(hand) + "/", 0) != 0) continue;
      if (path_text(profile) == now[side_of(part)]) parts.push_back(part);
    }
  }
  return parts;
}

XrResult xr_CreateActionSet(XrInstance handle, const XrActionSetCreateInfo* create,
                            XrActionSet* made) {
  const Call call("xrCreateActionSet", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  if (!legal_name(create->actionSetName))
    return w.violation("xrCreateActionSet: name", XR_ERROR_PATH_FORMAT_INVALID);
  if (!create->localizedActionSetName[0])
    return w.violation("xrCreateActionSet: label", XR_ERROR_LOCALIZED_NAME_INVALID);
  for (const auto& [id, object] : w.objects)
    if (object->kind == Kind::kActionSet &&
        static_cast<ActionSet*>(object.get())->name == create->actionSetName)
      return w.violation("xrCreateActionSet: twice", XR_ERROR_NAME_DUPLICATED);
  ActionSet& set = w.add<ActionSet>(Kind::kActionSet, call.instance->id);
  set.name = create->actionSetName;
  *made = handle_of<XrActionSet>(set.id);
  return XR_SUCCESS;
}

XrResult xr_DestroyActionSet(XrActionSet handle) {
  const Call call("xrDestroyActionSet", instance_of(handle));
  if (!call.instance) return call.answer();
  world().remove(id_of(handle));
  return XR_SUCCESS;
}

XrResult xr_CreateAction(XrActionSet handle, const XrActionCreateInfo* create, XrAction* made) {
  const Call call("xrCreateAction", instance_of(handle));
  if (call.answered()) return call.answer();
  World& w = world();
  const auto* set = w.find<ActionSet>(Kind::kActionSet, id_of(handle));
  if (set->attached)
    return w.violation("xrCreateAction: attached", XR_ERROR_ACTIONSETS_ALREADY_ATTACHED);
  if (!legal_name(create->actionName))
    return w.violation("xrCreateAction: name", XR_ERROR_PATH_FORMAT_INVALID);
  if (!create->localizedActionName[0])
    return w.violation("xrCreateAction: label", XR_ERROR_LOCALIZED_NAME_INVALID);
  for (const auto& [id, object] : w.objects)
    if (object->parent == set->id && static_cast<Action*>(object.get())->name == create->actionName)
      return w.violation("xrCreateAction: twice", XR_ERROR_NAME_DUPLICATED);
  Action& action = w.add<Action>(Kind::kAction, set->id);
  action.name = create->actionName;
  action.type = create->actionType;
  for (uint32_t i = 0; i < create->countSubactionPaths; ++i) {
    const std::string& text = path_text(create->subactionPaths[i]);
    if (text != "/user/hand/left" && text != "/user/hand/right")
      return w.violation("xrCreateAction: subaction " + text, XR_ERROR_PATH_UNSUPPORTED);
    action.hands.push_back(create->subactionPaths[i]);
  }
  *made = handle_of<XrAction>(action.id);
  return XR_SUCCESS;
}

XrResult xr_DestroyAction(XrAction handle) {
  const Call call("xrDestroyAction", instance_of(handle));
  if (!call.instance) return call.answer();
  world().remove(id_of(handle));
  return XR_SUCCESS;
}

XrResult xr_SuggestInteractionProfileBindings(
    XrInstance handle, const XrInteractionProfileSuggestedBinding* suggested) {
  const Call call("xrSuggestInteractionProfileBindings", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  const std::string& profile = path_text(suggested->interactionProfile);
  const bool of_hands = profile == "/interaction_profiles/ext/hand_interaction_ext";
  if (!is_profile(profile) || (of_hands && !w.enabled("XR_EXT_hand_interaction")))
    return XR_ERROR_PATH_UNSUPPORTED;
  if (!suggested->countSuggestedBindings) return w.violation("suggested bindings: none");
  std::vector<std::pair<uint64_t, XrPath>> lines;
  for (uint32_t i = 0; i < suggested->countSuggestedBindings; ++i) {
    const XrActionSuggestedBinding& binding = suggested->suggestedBindings[i];
    const auto* action = w.find<Action>(Kind::kAction, id_of(binding.action));
    if (!action) return w.violation("suggested bindings: action", XR_ERROR_HANDLE_INVALID);
    if (w.find<ActionSet>(Kind::kActionSet, action->parent)->attached)
      return w.violation("suggested bindings: attached", XR_ERROR_ACTIONSETS_ALREADY_ATTACHED);
    const std::pair key{suggested->interactionProfile, binding.binding};
    auto known = w.parts.find(key);
    if (known == w.parts.end())
      known = w.parts.emplace(key, has_part(profile, path_text(binding.binding))).first;
    if (!known->second) {
      return w.violation("suggested bindings: " + profile + " has no " + path_text(binding.binding),
                         XR_ERROR_PATH_UNSUPPORTED);
    }
    lines.emplace_back(action->id, binding.binding);
  }
  call.instance->suggested[suggested->interactionProfile] = lines;
  return XR_SUCCESS;
}

XrResult xr_AttachSessionActionSets(XrSession handle, const XrSessionActionSetsAttachInfo* attach) {
  const Call call("xrAttachSessionActionSets", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  if (!call.session->attached.empty())
    return w.violation("xrAttachSessionActionSets", XR_ERROR_ACTIONSETS_ALREADY_ATTACHED);
  for (uint32_t i = 0; i < attach->countActionSets; ++i) {
    auto* set = w.find<ActionSet>(Kind::kActionSet, id_of(attach->actionSets[i]));
    if (!set) return w.violation("xrAttachSessionActionSets: set", XR_ERROR_HANDLE_INVALID);
    set->attached = true;
    call.session->attached.push_back(set->id);
  }
  return XR_SUCCESS;
}

XrResult xr_GetCurrentInteractionProfile(XrSession handle, XrPath user,
                                         XrInteractionProfileState* state) {
  const Call call("xrGetCurrentInteractionProfile", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  if (call.session->attached.empty())
    return w.violation("xrGetCurrentInteractionProfile", XR_ERROR_ACTIONSET_NOT_ATTACHED);
  const std::string& text = path_text(user);
  if (text != "/user/hand/left" && text != "/user/hand/right")
    return w.violation("xrGetCurrentInteractionProfile: " + text, XR_ERROR_PATH_UNSUPPORTED);
  state->interactionProfile = XR_NULL_PATH;
  if (!call.session->synced) return XR_SUCCESS;
  const auto at = std::find(w.paths.begin(), w.paths.end(), w.profile_of(side_of(text)));
  if (at != w.paths.end()) state->interactionProfile = XrPath(at - w.paths.begin()) + 1;
  return XR_SUCCESS;
}

XrResult xr_SyncActions(XrSession handle, const XrActionsSyncInfo* sync) {
  const Call call("xrSyncActions", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  for (uint32_t i = 0; i < sync->countActiveActionSets; ++i) {
    const auto& sets = call.session->attached;
    if (std::find(sets.begin(), sets.end(), id_of(sync->activeActionSets[i].actionSet)) ==
        sets.end())
      return w.violation("xrSyncActions", XR_ERROR_ACTIONSET_NOT_ATTACHED);
  }
  if (call.session->state != XR_SESSION_STATE_FOCUSED) return XR_SESSION_NOT_FOCUSED;
  const std::array<std::string, 2> profiles{w.profile_of(0), w.profile_of(1)};
  if (!call.session->synced || profiles != call.session->profiles) {
    XrEventDataInteractionProfileChanged changed{XR_TYPE_EVENT_DATA_INTERACTION_PROFILE_CHANGED};
    changed.session = handle;
    XrEventDataBuffer buffer{XR_TYPE_EVENT_DATA_BUFFER};
    std::memcpy(&buffer, &changed, sizeof changed);
    w.events.push_back(buffer);
  }
  call.session->synced = true;
  call.session->profiles = profiles;
  call.session->input_before = call.session->input;
  call.session->input = w.inputs;
  for (auto tap = w.taps.begin(); tap != w.taps.end();) {
    const std::string part = *tap;
    if (call.session->input_before[part] < 0.5F) {
      call.session->input[part] = 1.0F;
      w.taps.erase(tap);
    }
    tap = w.taps.upper_bound(part);
  }
  for (const int side : {0, 1})
    if (const auto seen = w.fingers[side] ? w.fingers[side](w.time) : std::nullopt)
      call.session->input[std::string("/user/hand/") + (side ? "right" : "left") +
                          "/input/pinch_ext/value"] = pinch_of(*seen);
  return XR_SUCCESS;
}

XrResult xr_GetActionStateBoolean(XrSession handle, const XrActionStateGetInfo* get,
                                  XrActionStateBoolean* state) {
  const Call call("xrGetActionStateBoolean", handle);
  const Asked asked = ask(call, "xrGetActionStateBoolean", get, XR_ACTION_TYPE_BOOLEAN_INPUT);
  if (asked.bad) return *asked.bad;
  state->isActive = asked.active;
  state->currentState = asked.value > 0.5F;
  state->changedSinceLastSync = (asked.value > 0.5F) != (asked.before > 0.5F);
  state->lastChangeTime = state->changedSinceLastSync ? world().time : 0;
  return XR_SUCCESS;
}

XrResult xr_GetActionStateFloat(XrSession handle, const XrActionStateGetInfo* get,
                                XrActionStateFloat* state) {
  const Call call("xrGetActionStateFloat", handle);
  const Asked asked = ask(call, "xrGetActionStateFloat", get, XR_ACTION_TYPE_FLOAT_INPUT);
  if (asked.bad) return *asked.bad;
  state->isActive = asked.active;
  state->currentState = asked.value;
  state->changedSinceLastSync = asked.value != asked.before;
  state->lastChangeTime = 0;
  return XR_SUCCESS;
}

XrResult xr_GetActionStateVector2f(XrSession handle, const XrActionStateGetInfo* get,
                                   XrActionStateVector2f* state) {
  const Call call("xrGetActionStateVector2f", handle);
  const Asked asked = ask(call, "xrGetActionStateVector2f", get, XR_ACTION_TYPE_VECTOR2F_INPUT);
  if (asked.bad) return *asked.bad;
  state->isActive = asked.active;
  state->currentState = {0, 0};
  state->changedSinceLastSync = XR_FALSE;
  state->lastChangeTime = 0;
  return XR_SUCCESS;
}

XrResult xr_GetActionStatePose(XrSession handle, const XrActionStateGetInfo* get,
                               XrActionStatePose* state) {
  const Call call("xrGetActionStatePose", handle);
  const Asked asked = ask(call, "xrGetActionStatePose", get, XR_ACTION_TYPE_POSE_INPUT);
  if (asked.bad) return *asked.bad;
  state->isActive = asked.active;
  return XR_SUCCESS;
}

XrResult xr_EnumerateBoundSourcesForAction(XrSession handle,
                                           const XrBoundSourcesForActionEnumerateInfo* info,
                                           uint32_t capacity, uint32_t* count, XrPath* sources) {
  const Call call("xrEnumerateBoundSourcesForAction", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  const auto* action = w.find<Action>(Kind::kAction, id_of(info->action));
  if (!action) return w.violation("xrEnumerateBoundSourcesForAction", XR_ERROR_HANDLE_INVALID);
  std::vector<XrPath> bound;
  for (const std::string& part : bound_parts(*action, XR_NULL_PATH))
    bound.push_back(XrPath(std::find(w.paths.begin(), w.paths.end(), part) - w.paths.begin()) + 1);
  return enumerate(bound, capacity, count, sources, [](auto from, auto& to) { to = from; });
}

XrResult xr_GetInputSourceLocalizedName(XrSession handle,
                                        const XrInputSourceLocalizedNameGetInfo* get,
                                        uint32_t capacity, uint32_t* count, char* text) {
  const Call call("xrGetInputSourceLocalizedName", handle);
  if (call.answered()) return call.answer();
  return copy_text("made " + path_text(get->sourcePath), capacity, count, text);
}

static XrResult vibrate(const Call& call, const char* function, const XrHapticActionInfo* info,
                        const XrHapticVibration* vibration) {
  if (call.answered()) return call.answer();
  World& w = world();
  const auto* action = w.find<Action>(Kind::kAction, id_of(info->action));
  if (!action || action->type != XR_ACTION_TYPE_VIBRATION_OUTPUT)
    return w.violation(std::string(function) + ": action", XR_ERROR_ACTION_TYPE_MISMATCH);
  const auto& sets = call.session->attached;
  if (std::find(sets.begin(), sets.end(), action->parent) == sets.end())
    return w.violation(std::string(function) + ": attached", XR_ERROR_ACTIONSET_NOT_ATTACHED);
  if (call.session->state != XR_SESSION_STATE_FOCUSED) return XR_SESSION_NOT_FOCUSED;
  if (!vibration) {
    ++w.vibration_stops;
    return XR_SUCCESS;
  }
  if (vibration->type != XR_TYPE_HAPTIC_VIBRATION || !(vibration->amplitude >= 0) ||
      vibration->amplitude > 1 ||
      (vibration->duration <= 0 && vibration->duration != XR_MIN_HAPTIC_DURATION))
    return w.violation(std::string(function) + ": vibration");
  w.vibrations.push_back(
      {action->name, info->subactionPath, vibration->amplitude, vibration->duration});
  return XR_SUCCESS;
}

XrResult xr_ApplyHapticFeedback(XrSession handle, const XrHapticActionInfo* info,
                                const XrHapticBaseHeader* haptic) {
  const Call call("xrApplyHapticFeedback", handle);
  return vibrate(call, "xrApplyHapticFeedback", info,
                 reinterpret_cast<const XrHapticVibration*>(haptic));
}

XrResult xr_StopHapticFeedback(XrSession handle, const XrHapticActionInfo* info) {
  const Call call("xrStopHapticFeedback", handle);
  return vibrate(call, "xrStopHapticFeedback", info, nullptr);
}

}  // namespace palpate::test::fake
