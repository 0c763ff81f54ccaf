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
  kWorkspaceEdge,  ///< near the end of the device's reach: the force fades, the loop does not stop
  kFirstContact,   ///< the force of a hard first touch rises slowly
  kOscillation,    ///< the force oscillates
  kHot,            ///< the motors' thermal model: reduced to what they can sustain
  kEnergy,         ///< the hand would get more energy than allowed
  /// the motion could not be inverted at the proxy: its point is frozen and the force fades
  kField,
  kConfidence,  ///< the motion field is not reliable here: the force fades
  kSceneEmpty,  ///< nothing to feel
  kStopped,     ///< a stop was asked for: by a command, a signal, or a crash of another thread
  kUnseen,      ///< no viewer shows the scene: the picture in the headset is gone
  kSudden,      ///< a constraint on the hand ended or changed suddenly: the force follows slowly
  kReturn,      ///< the hand would get more energy back than it put in: the force comes back slowly
  kShaking,     ///< the force oscillates because the scene does, and not the loop
};

/// One word for logs ("too-fast"), and one sentence for people. Static storage.
const char* word(Cause cause) noexcept;
const char* sentence(Cause cause) noexcept;

}  // namespace palpate
