#pragma once

namespace palpate {

/// How fast the scene's force may change, by the event that changes it. docs/force-limits.md has
/// the whole chain from the scene to the hand; the limits at its end are in SafetyOptions.

/// A person switches a mode, or turns a gain or the stiffness. Together with what friction adds it
/// stays below the 20 N/s (0.02 N per ms) from which on a hand at rest feels a change as an event.
inline constexpr double kRamp_n_per_s = 12.0;
/// The scene is exchanged, or taken away: 0.015 N per ms.
inline constexpr double kExchange_n_per_s = 15.0;
/// The scene changes at once what the hand feels: 0.03 N per ms. A wall of 500 N/m may move with up
/// to 60 mm/s without being felt late.
inline constexpr double kSudden_n_per_s = 30.0;
/// The material point can not be found: 0.05 N per ms.
inline constexpr double kFade_n_per_s = 50.0;

}  // namespace palpate
