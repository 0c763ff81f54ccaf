#pragma once

#include <memory>

#include "module/xr/frame_loop.h"
#include "module/xr/refresh_rate.h"

namespace palpate::xr {

/// What became of one round of a live session.
struct Round {
  Duty duty = Duty::kNone;  ///< kDropLost, kDropEnded, or kNone: go on
  bool framed = false;
  FrameResult frame;
};

/// A session and everything that depends on it, created and destroyed in order. Not movable.
class LiveSession {
 public:
  static Outcome<std::unique_ptr<LiveSession>> make(const Instance& instance, const System& system,
                                                    std::shared_ptr<vulkan::Context> context,
                                                    const HeadsetOptions& options,
                                                    Colocation& colocation);
  LiveSession(const LiveSession&) = delete;
  LiveSession& operator=(const LiveSession&) = delete;

  /// Polls events, obeys the session's state, and runs a frame if one is wanted.
  Outcome<Round> round(PictureSource& source);
  Done request_exit() { return session_.request_exit(); }
  Done vibrate(int hand, double amplitude);

  const OpenXrSession& session() const { return session_; }
  Origin origin() const { return spaces_.origin(); }
  XrEnvironmentBlendMode blend() const { return blend_; }
  bool see_through() const { return overlay_ || blend_ == XR_ENVIRONMENT_BLEND_MODE_ALPHA_BLEND; }
  bool main_visible() const { return main_visible_; }
  const HandTracking& tracking() const { return tracking_; }
  bool bare_hands() const { return tracking_.works() || actions_.bare_hands(); }
  const RenderModels& models() const { return models_; }
  const DisplayRate& display() const { return refresh_.rate(); }
  const Problem& no_panel() const { return loop_.no_panel(); }

 private:
  LiveSession(const Instance& instance, const System& system, Colocation& colocation,
              OpenXrSession session, Spaces spaces, Actions actions, HandTracking tracking,
              RefreshRate refresh, FrameLoop loop, XrEnvironmentBlendMode blend, bool overlay);
  Outcome<Duty> poll();
  Outcome<Duty> obey(const XrEventDataBuffer& event);
  void space_changes(const XrEventDataReferenceSpaceChangePending& change);

  const Instance& instance_;
  const System& system_;
  Colocation& colocation_;
  OpenXrSession session_;
  Spaces spaces_;
  Actions actions_;
  HandTracking tracking_;
  RenderModels models_;
  RefreshRate refresh_;
  FrameLoop loop_;
  XrEnvironmentBlendMode blend_;
  bool overlay_;
  bool main_visible_ = true;
  XrEventDataBuffer event_{};
  std::array<bool, 2> vibrating_{};
  int64_t period_ns_ = 0;
};

}  // namespace palpate::xr
