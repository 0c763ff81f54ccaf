#pragma once

#include <cstdint>

namespace palpate::xr {

/// The states of a session as the runtime announces them (XrSessionState, same order).
enum class SessionState : uint8_t {
  kUnknown,
  kIdle,
  kReady,
  kSynchronized,
  kVisible,
  kFocused,
  kStopping,
  kLossPending,
  kExiting
};

/// What the program must do now.
enum class Duty : uint8_t {
  kNone,
  kBegin,     ///< xrBeginSession
  kEnd,       ///< xrEndSession
  kDropLost,  ///< destroy the session and ask for a new one
  kDropEnded  ///< destroy the session: the person wants no more
};

/// The part of a session's life that is bookkeeping: which frames may run, what an announcement
/// asks for. OpenXR 1.0, section "Session Lifecycle". A value; announcements out of order (a second
/// READY, STOPPING while not running) ask for nothing, so that the order of calls stays valid.
class Lifecycle {
 public:
  /// The runtime announced a state.
  Duty announced(SessionState state) {
    state_ = state;
    switch (state) {
      case SessionState::kReady:
        return running_ ? Duty::kNone : Duty::kBegin;
      case SessionState::kStopping:
        return running_ ? Duty::kEnd : Duty::kNone;
      case SessionState::kLossPending:
        return Duty::kDropLost;
      case SessionState::kExiting:
        return Duty::kDropEnded;
      default:
        return Duty::kNone;
    }
  }
  /// xrBeginSession or xrEndSession succeeded.
  void begun() { running_ = true; }
  void ended() { running_ = false; }

  SessionState state() const { return state_; }
  /// Frames must be waited for, begun and ended.
  bool running() const { return running_; }
  bool visible() const {
    return running_ && (state_ == SessionState::kVisible || state_ == SessionState::kFocused);
  }
  bool focused() const { return running_ && state_ == SessionState::kFocused; }

 private:
  SessionState state_ = SessionState::kUnknown;
  bool running_ = false;
};

}  // namespace palpate::xr
