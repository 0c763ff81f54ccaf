#pragma once

#include <memory>
#include <string>

#include "integration/running/session_request.h"
#include "module/haptics/device.h"
#include "module/haptics/servo/position_source.h"
#include "module/haptics/servo/servo_clock.h"

namespace palpate::running {

/// What can be the hand where no force device is there.
struct OtherHands {
  bool window = false;          ///< a mouse
  bool headset = false;         ///< a controller
  bool simulated = false;       ///< a simulated one, if nothing else is there
  bool page = false;            ///< a pointer in a live page
  ServoClock* clock = nullptr;  ///< whose time a simulated one has; null: the monotonic clock
};

/// The device of a session.
struct FeltDevice {
  std::unique_ptr<ForceDevice> device;  ///< null where the host ticks
  DeviceInfo info;                      ///< of it, or of the host's
  std::string why;                      ///< which device it is, and why: a sentence
  bool is_simulated = false;
  /// No force can hurt its hand: it is simulated, or feels none. A late tick may be later there.
  bool is_harmless = false;
  bool has_true_size = false;            ///< the hand moves in the world: nothing is scaled to it
  PositionSource* mouse = nullptr;       ///< the device, if it is a mouse; moved by the window
  PositionSource* controller = nullptr;  ///< likewise; moved in the headset
  PositionSource* tool = nullptr;        ///< likewise; moved by a tracker
  PositionSource* page = nullptr;        ///< likewise; moved by browsers
  double path_s = 0.0;                   ///< simulated: duration of the hand's path
};

/// Opens the device that the request names: "auto" (the first kind that answers within a second;
/// else what `others` have), "mouse", "controller", "page", "simulated", "none" (viewing only), a
/// tracked tool's igtl://HOST:PORT (another thread moves it), or a kind of
/// devices::force_device_kinds(). After a kind may stand '@' and the device's own address. fit:
/// first the scene is scaled to the device's reach, see fit_to_reach(). Errors: kBadInput,
/// kNoDevice, in one sentence. Any thread.
Result<FeltDevice> open_felt_device(const SessionRequest& request, LoadedScene& scene, bool fit,
                                    const OtherHands& others);

}  // namespace palpate::running
