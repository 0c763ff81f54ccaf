#include "module/xr/live_session.h"

#include <algorithm>
#include <cstring>

namespace palpate::xr {
namespace {

XrEnvironmentBlendMode blend_mode(BlendMode wanted, const System& system) {
  const XrEnvironmentBlendMode mode =
      wanted == BlendMode::kAdditive ? XR_ENVIRONMENT_BLEND_MODE_ADDITIVE
      : wanted == BlendMode::kAlpha  ? XR_ENVIRONMENT_BLEND_MODE_ALPHA_BLEND
                                     : XR_ENVIRONMENT_BLEND_MODE_OPAQUE;
  const auto& offered = system.blend_modes;
  const bool there = std::find(offered.begin(), offered.end(), mode) != offered.end();
  return there ? mode : offered.front();
}

/// The event as its own type. A buffer may not be read through another type's pointer.
template <class Event>
Event as(const XrEventDataBuffer& buffer) {
  Event event;
  static_assert(sizeof(Event) <= sizeof(XrEventDataBuffer));
  std::memcpy(&event, &buffer, sizeof event);
  return event;
}

}  // namespace

Outcome<std::unique_ptr<LiveSession>> LiveSession::make(const Instance& instance,
                                                        const System& system,
                                                        std::shared_ptr<vulkan::Context> context,
                                                        const HeadsetOptions& options,
                                                        Colocation& colocation) {
  auto session = OpenXrSession::make(instance, system, context, options.overlay);
  if (!session) return session.error();
  auto spaces = Spaces::make(*session, system, options.origin);
  if (!spaces) return spaces.error();
  auto actions = Actions::make(instance, *session);
  if (!actions) return actions.error();
  auto tracking = HandTracking::make(instance, system, *session);
  if (!tracking) return tracking.error();
  const auto refresh = RefreshRate::make(instance, *session, options.refresh_hz);
  if (!refresh) return refresh.error();
  colocation.set_base(spaces->origin() == Origin::kStage ? Room::kStage : Room::kLocal);
  return std::unique_ptr<LiveSession>(new LiveSession(
      instance, system, colocation, std::move(*session), std::move(*spaces), std::move(*actions),
      std::move(*tracking), *refresh, FrameLoop(std::move(context), options.view_scale),
      blend_mode(options.blend, system), options.overlay.has_value()));
}

LiveSession::LiveSession(const Instance& instance, const System& system, Colocation& colocation,
                         OpenXrSession session, Spaces spaces, Actions actions,
                         HandTracking tracking, RefreshRate refresh, FrameLoop loop,
                         XrEnvironmentBlendMode blend, bool overlay)
    : instance_(instance),
      system_(system),
      colocation_(colocation),
      session_(std::move(session)),
      spaces_(std::move(spaces)),
      actions_(std::move(actions)),
      tracking_(std::move(tracking)),
      models_(instance),
      refresh_(std::move(refresh)),
      loop_(std::move(loop)),
      blend_(blend),
      overlay_(overlay) {}

Outcome<Round> LiveSession::round(PictureSource& source) {
  Round round;
  const Outcome<Duty> duty = poll();
  if (!duty) return duty.error();
  round.duty = *duty;
  if (*duty != Duty::kNone || !session_.life().running()) return round;
  const auto frame = loop_.run({instance_, system_, session_, spaces_, actions_, tracking_, models_,
                                colocation_, source, blend_, see_through()});
  if (!frame) return frame.error();
  round.framed = true;
  round.frame = *frame;
  period_ns_ = frame->period_ns;
  // The program below an overlay has chosen a rate for its own pictures.
  const Done chosen = refresh_.step(session_, overlay_ ? 0.0 : source.needed_period_s());
  if (!chosen) return chosen.error();
  return round;
}

Outcome<Duty> LiveSession::poll() {
  for (;;) {
    const Outcome<bool> there = instance_.next_event(event_);
    if (!there) return there.error();
    if (!*there) return Duty::kNone;
    const Outcome<Duty> duty = obey(event_);
    if (!duty || *duty != Duty::kNone) return duty;
  }
}

Outcome<Duty> LiveSession::obey(const XrEventDataBuffer& event) {
  if (event.type == kModelsChangedEvent) models_.changed();
  switch (event.type) {
    case XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED: {
      const auto changed = as<XrEventDataSessionStateChanged>(event);
      if (changed.session != session_.handle()) return Duty::kNone;
      const bool was_focused = session_.life().focused();
      const Outcome<Duty> duty = session_.announced(changed.state);
      // A vibration that was started would go on to its end.
      if (was_focused && !session_.life().focused()) vibrating_ = {};
      return duty;
    }
    case XR_TYPE_EVENT_DATA_REFERENCE_SPACE_CHANGE_PENDING: {
      const auto change = as<XrEventDataReferenceSpaceChangePending>(event);
      if (change.session == session_.handle()) space_changes(change);
      return Duty::kNone;
    }
    case XR_TYPE_EVENT_DATA_INTERACTION_PROFILE_CHANGED: {
      // Some runtimes do not say that their models have changed with it.
      models_.changed();
      const Done asked = actions_.ask_profiles(instance_, session_);
      if (!asked) return asked.error();
      return Duty::kNone;
    }
    case XR_TYPE_EVENT_DATA_VISIBILITY_MASK_CHANGED_KHR:
      loop_.forget_mask(as<XrEventDataVisibilityMaskChangedKHR>(event).viewIndex);
      return Duty::kNone;
    case XR_TYPE_EVENT_DATA_DISPLAY_REFRESH_RATE_CHANGED_FB:
      refresh_.changed(as<XrEventDataDisplayRefreshRateChangedFB>(event).toDisplayRefreshRate);
      return Duty::kNone;
    case XR_TYPE_EVENT_DATA_MAIN_SESSION_VISIBILITY_CHANGED_EXTX:
      main_visible_ = as<XrEventDataMainSessionVisibilityChangedEXTX>(event).visible == XR_TRUE;
      return Duty::kNone;
    case XR_TYPE_EVENT_DATA_INSTANCE_LOSS_PENDING:
      return problem_of("xrPollEvent", XR_ERROR_INSTANCE_LOST);
    default:
      return Duty::kNone;
  }
}

void LiveSession::space_changes(const XrEventDataReferenceSpaceChangePending& change) {
  const auto room = spaces_.room_of(change.referenceSpaceType);
  if (!room) return;
  std::optional<Pose> previous_from_new;
  if (change.poseValid) previous_from_new = pose_of(change.poseInPreviousSpace);
  colocation_.change(*room, change.changeTime, previous_from_new);
}

Done LiveSession::vibrate(int hand, double amplitude) {
  if (!session_.life().focused()) return Nothing{};
  bool& running = vibrating_[size_t(hand)];
  if (!(amplitude > 0.0) && !running) return Nothing{};
  running = amplitude > 0.0;
  return actions_.vibrate(session_, hand, amplitude, 2 * period_ns_);
}

}  // namespace palpate::xr
