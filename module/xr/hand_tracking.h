#pragma once

#include <array>
#include <string>

#include "module/xr/hands.h"
#include "module/xr/session.h"

namespace palpate::xr {

/// Whether thumb and forefinger pinch, from the gap between them, m: a pinch begins when they touch
/// and ends only when they are well apart, so that a noisy tracker does not make two of one. A
/// value.
class Pinch {
 public:
  static constexpr double kBegins_m = 0.004, kEnds_m = 0.014;
  /// NaN: the fingers are not seen, and it ends.
  bool step(double gap_m) noexcept {
    pinches_ = gap_m < (pinches_ ? kEnds_m : kBegins_m);
    return pinches_;
  }

 private:
  bool pinches_ = false;
};

/// Eighth in the life cycle: hands without controllers by their joints (XR_EXT_hand_tracking),
/// where runtime and headset have them, and Actions gives none. Without them no call is made and no
/// hand is reported. Move-only.
class HandTracking {
 public:
  /// Fails only where the session is lost: if the runtime can not track after all, hands are left
  /// out.
  static Outcome<HandTracking> make(const Instance& instance, const System& system,
                                    const OpenXrSession& session);

  /// Where the fingers are at `time`; those that are seen already stay as they are. A runtime that
  /// refuses is not asked again in this session.
  Done read(XrSpace base, XrTime time, const Pose& world_from_base,
            std::array<Fingers, 2>& fingers);

  /// Whether there are hands to be asked for.
  bool works() const { return trackers_[0] && trackers_[1]; }
  /// The call that was refused, "xrLocateHandJointsEXT returned -2"; empty: none.
  const std::string& refused() const { return refused_; }

 private:
  Done refuse(const Problem& problem);
  void see(const XrHandJointLocationEXT* joints, const Pose& world_from_base, size_t side,
           Fingers& fingers);

  PFN_xrLocateHandJointsEXT locate_ = nullptr;
  std::array<ExtensionHandle<XrHandTrackerEXT>, 2> trackers_;  ///< left, right
  std::array<Pinch, 2> pinches_;
  std::string refused_;
};

}  // namespace palpate::xr
