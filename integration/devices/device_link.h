#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

#include "module/haptics/device.h"

namespace palpate::devices {

/// What one exchange with a device brought.
struct LinkAnswer {
  bool answered = false;  ///< position_m and buttons are new
  bool garbage = false;   ///< something came that was no answer
  bool lost = false;      ///< the link no longer works: it has to be closed and opened again
  /// The fault that the device or the link reports. With `answered`: why the position is not valid.
  DeviceFault said = DeviceFault::kNone;
  glm::dvec3 position_m{0.0};  ///< device space as in DeviceInfo
  uint32_t buttons = 0;
  GripReading grip;
};

/// The link to a device that answers at its own pace: a socket, a maker's library, a serial line.
/// MailboxDevice makes a ForceDevice of it. All functions are called by one thread, which may wait;
/// if a function never returns, the force ends and that thread is lost, nothing else.
class DeviceLink {
 public:
  virtual ~DeviceLink() = default;

  /// Looks for the device once and makes it ready, its motors at zero. kNone: exchange() may be
  /// called. Else why there is none (kNotOpened: nothing is there), and nothing is left open.
  virtual DeviceFault open() = 0;

  /// What the device can do; its best guess, on the safe side, before it was opened. Between open()
  /// and close() it does not change.
  virtual DeviceInfo info() const = 0;

  /// The torque that goes with the forces of further exchanges, about the device's position, finite
  /// and within info().max_torque_n_m. Only a link whose device gives one has to take it.
  virtual void set_torque(glm::dvec3 /*torque_n_m*/) {}

  /// Sends a force, finite and within info().max_force_n, and waits for the answer, for a few
  /// milliseconds at most.
  virtual LinkAnswer exchange(glm::dvec3 force_n) = 0;

  /// Motors at zero, if they can be reached, and everything closed. After open() gave kNone, once.
  virtual void close() noexcept = 0;
};

}  // namespace palpate::devices
