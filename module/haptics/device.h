#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>

#include "module/haptics/grip.h"

namespace palpate {

/// What a force device can do. Space: the device's own, m, x right, y up, z towards the user.
struct DeviceInfo {
  std::string kind;          ///< "falcon", "simulated"
  std::string name;          ///< for people
  std::string address;       ///< where it is plugged in: "usb 1-2", or empty
  double max_force_n = 0.0;  ///< the largest that it can give for a short time in every direction
  /// what its motors hold for ever; 0: not stated, and their heat is not modelled
  double continuous_force_n = 0.0;
  double max_torque_n_m = 0.0;         ///< the largest that it can give; 0: it gives none
  double max_stiffness_n_per_m = 0.0;  ///< that its maker or experience calls stable
  glm::dvec3 workspace_centre_m{0.0};
  double workspace_radius_m = 0.0;
  double resolution_m = 0.0;  ///< of the position, at the centre
  double delay_s = 0.0;       ///< from taking a position to the force of its frame on the motors
  int sensed_dof = 3, actuated_dof = 3;
  int buttons = 0;
};

/// Why a device gives no position, or one that must not be trusted. Each has a sentence: see
/// sentence().
enum class DeviceFault : uint8_t {
  kNone,
  kNotOpened,     ///< nothing was found yet; the search goes on
  kNoPermission,  ///< the system does not let this user open it: the udev rule is missing
  kNoFirmware,    ///< it needs its maker's firmware file, which palpate does not have
  kStarting,      ///< firmware is being loaded, or settings made
  kNotHomed,      ///< the user has to move the grip out and in again
  kUnplugged,
  kTimeout,     ///< no answer in time
  kTransfer,    ///< the bus refused or stalled a transfer
  kGarbage,     ///< answers that are no answers
  kOutOfReach,  ///< the encoders report a place that the arms can not reach
  kJumped,      ///< the position jumped further than a hand can move
  kStuck,       ///< the position does not move at all while the force changes
  kBusy,        ///< another program holds it
  kForceOff,    ///< it has switched its force off, or its brakes on, by itself or by its button
  kNoHand,  ///< nothing is wrong: no controller or tool is there, no finger pinches, no pen is held
  kHot,     ///< its motors are too warm
  kNoLibrary,  ///< its maker's library was not found, or lacks what is needed
};

/// One sentence: what is wrong and what to do. Static storage.
const char* sentence(DeviceFault fault) noexcept;

/// What the servo loop gives the device, once per exchange.
struct DeviceCommand {
  glm::dvec3 force_n{0.0};  ///< on the hand; the device clamps to its motors, keeping the direction
  bool in_contact = false;  ///< for a light
  /// On the grip, about its position; only of a tool of several points. Most devices give none.
  glm::dvec3 torque_n_m{0.0};
};

/// What it gets back.
struct DeviceReading {
  glm::dvec3 position_m{0.0};  ///< of the grip; the last good one if fault is set
  int64_t time_ns = 0;         ///< monotonic time at which the position was taken
  uint32_t buttons = 0;        ///< bit k: button k is down
  DeviceFault fault = DeviceFault::kNone;
  bool fresh = false;  ///< position_m is new since the last exchange
  GripReading grip;    ///< believable
};

/// A force device. exchange() is called by one thread, the servo's, about 1,000 times a second.
/// After a fault the motors are at zero before a reading without fault is given, and after the
/// destructor they are at zero too.
class ForceDevice {
 public:
  virtual ~ForceDevice() = default;
  /// Does not change while the object lives, except name and address on a re-plug. Not real-time
  /// safe.
  virtual DeviceInfo info() const = 0;
  /// Sends a force, returns the newest position. Never blocks longer than about a millisecond;
  /// never throws; does not allocate in our code. After a fault the device goes on looking for its
  /// hardware by itself.
  virtual DeviceReading exchange(const DeviceCommand& command) noexcept = 0;
};

}  // namespace palpate
