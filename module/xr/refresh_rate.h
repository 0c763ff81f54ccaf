#pragma once

#include "module/xr/display_rate.h"
#include "module/xr/session.h"

namespace palpate::xr {

/// Chooses the display's rate, once per session: as wanted, or the highest one that the pictures
/// can hold, as soon as it is known what they need. Without the extension no call is made.
/// Copyable; borrows the instance.
class RefreshRate {
 public:
  /// wanted_hz: 0 for the highest that the pictures can hold. Fails only where the session is lost:
  /// if the runtime refuses, the rate stays as it is.
  static Outcome<RefreshRate> make(const Instance& instance, const OpenXrSession& session,
                                   double wanted_hz);

  /// Once per frame. needed_s: PictureSource::needed_period_s().
  Done step(const OpenXrSession& session, double needed_s);
  /// The runtime has changed the rate.
  void changed(double hz) { rate_.hz = hz; }

  const DisplayRate& rate() const { return rate_; }

 private:
  Done ask(const OpenXrSession& session);
  Done refuse(const Problem& problem);

  const Instance* instance_ = nullptr;
  double wanted_hz_ = 0.0;
  DisplayRate rate_;
};

}  // namespace palpate::xr
