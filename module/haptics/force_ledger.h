#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>

namespace palpate {

/// Who changes the force on its way from the scene to the hand (docs/force-limits.md says how much
/// and how fast).
enum class Limiter : uint8_t {
  kTank,          ///< the surface slips past the hand: the scene's energy is spent
  kBridge,        ///< a change by the scene itself comes slowly
  kOff,           ///< the force is off or on its ramp to zero: the tick's cause says why
  kMagnitude,     ///< the most that this session and this device may give
  kOscillation,   ///< the force oscillates
  kStart,         ///< the ramp after the start gate
  kDamping,       ///< against a hand that is too fast, and while the force comes up
  kEdge,          ///< the part outwards at the end of the workspace
  kFinite,        ///< a value that was not finite
  kHeat,          ///< hot motors
  kReturn,        ///< energy that the hand did not put in
  kFirstContact,  ///< the force of a new contact rises slowly
  kSlew,          ///< no force changes faster
  kPower,         ///< the hand gets more power than it gives
};
inline constexpr size_t kLimiters = size_t(Limiter::kPower) + 1;

/// One word for logs ("first-contact"), and one sentence for people. Static storage.
const char* word(Limiter limiter) noexcept;
const char* sentence(Limiter limiter) noexcept;

/// Where the newtons of a haptic frame went: asked_n minus all of held_n is the force that the
/// device was given, in every frame, to the rounding of fourteen additions. Space: the device's, N.
/// What weakens the scene before its forces are balanced (the ramp of a mode that is switched, low
/// confidence, the fade of a lost point, the device's stiffness) moves the proxy, and is part of
/// asked_n.
struct ForceLedger {
  /// What the spring between hand and proxy would give if nothing limited it; 0 where it is not
  /// finite.
  glm::dvec3 asked_n{0.0};
  /// What each limiter takes away; it adds where this points against asked_n.
  std::array<glm::dvec3, kLimiters> held_n{};

  glm::dvec3& operator[](Limiter limiter) noexcept { return held_n[size_t(limiter)]; }
  const glm::dvec3& operator[](Limiter limiter) const noexcept { return held_n[size_t(limiter)]; }
  /// asked_n minus all that is held back.
  glm::dvec3 left_n() const noexcept;
};

}  // namespace palpate
