#pragma once

namespace palpate {

/// How fast the scene's force may change, by what changes it. docs/force-limits.md has the whole
/// chain from the scene to the hand; what may leave it in the end is SafetyOptions' business.

/// A person switches a mode, or turns a gain or the stiffness. With what friction adds to it, below
/// the 20 N/s (0.02 N per ms) at which a hand at rest begins to take a change for an event.
inline constexpr double kRamp_n_per_s = 12.0;
/// The scene is exchanged, or taken away: 0.015 N per ms.
inline constexpr double kExchange_n_per_s = 15.0;
/// The scene changes at once what the hand feels: 0.03 N per ms. A wall of 500 N/m may move with 60
/// mm/s before it is felt late.
inline constexpr double kSudden_n_per_s = 30.0;
/// What is felt can not be known: 0.05 N per ms.
inline constexpr double kFade_n_per_s = 50.0;

}  // namespace palpate
