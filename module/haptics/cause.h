#pragma once

#include <cstdint>

namespace palpate {

/// Why the force is not the scene's. The first cause that brings the force down is latched until
/// the hand is free again.
enum class Cause : uint8_t {
  kNone,
  kStarting,       ///< start gate: waiting for a small wanted force, then the ramp
  kDeadMan,        ///< the dead-man switch is open
  kDevice,         ///< the device reports a fault (which one: DeviceFault)
  kNotFinite,      ///< a position or a force was NaN or infinite
  kLate,           ///< watchdog: the loop was late
  kClock,          ///< time stood still, went backwards or jumped
  kTooFast,        ///< the hand moves faster than the velocity limit
  kWorkspaceEdge,  ///< near the end of the device's reach: faded, not tripped
  kFirstContact,   ///< a large force at the first touch is let in slowly
  kOscillation,    ///< the force buzzes
  kHot,            ///< the motors' thermal model: faded to what they can hold
  kEnergy,         ///< more energy would leave than may
  kField,  ///< the motion could not be inverted at the proxy: its point is frozen and the force
           // /< faded
  kConfidence,  ///< the motion field is not trusted here: faded
  kSceneEmpty,  ///< nothing to feel
  kStopped,     ///< a stop was asked for: by a command, a signal, or a crash of another thread
  kUnseen,      ///< nobody sees the scene: the picture in the headset is gone
  kSudden,      ///< a constraint on the hand ended or changed at once: the force follows slowly
};

/// One word for logs ("too-fast"), and one sentence for people. Static storage.
const char* word(Cause cause) noexcept;
const char* sentence(Cause cause) noexcept;

}  // namespace palpate
