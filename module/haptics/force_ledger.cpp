#include "module/haptics/force_ledger.h"

namespace palpate {

const char* word(Limiter limiter) noexcept {
  switch (limiter) {
    case Limiter::kTank:
      return "tank";
    case Limiter::kBridge:
      return "bridge";
    case Limiter::kOff:
      return "off";
    case Limiter::kMagnitude:
      return "magnitude";
    case Limiter::kOscillation:
      return "oscillation";
    case Limiter::kStart:
      return "start";
    case Limiter::kDamping:
      return "damping";
    case Limiter::kEdge:
      return "edge";
    case Limiter::kFinite:
      return "finite";
    case Limiter::kHeat:
      return "heat";
    case Limiter::kReturn:
      return "return";
    case Limiter::kFirstContact:
      return "first-contact";
    case Limiter::kSlew:
      return "slew";
    case Limiter::kPower:
      return "power";
  }
  return "unknown";
}

const char* sentence(Limiter limiter) noexcept {
  switch (limiter) {
    case Limiter::kTank:
      return "The scene had spent its energy: the surface slipped past the hand.";
    case Limiter::kBridge:
      return "The scene changed suddenly: the force followed slowly.";
    case Limiter::kOff:
      return "The force was off, or on its ramp to zero.";
    case Limiter::kMagnitude:
      return "The force was cut at the most that is allowed.";
    case Limiter::kOscillation:
      return "The force oscillated and was lowered.";
    case Limiter::kStart:
      return "The force came up slowly after a start.";
    case Limiter::kDamping:
      return "The hand was damped: it was too fast, or the force was coming up.";
    case Limiter::kEdge:
      return "The hand was at the edge of the device's reach.";
    case Limiter::kFinite:
      return "A force was not finite.";
    case Limiter::kHeat:
      return "The motors were hot.";
    case Limiter::kReturn:
      return "The hand would have got more energy back than it put in.";
    case Limiter::kFirstContact:
      return "The force of a new contact rose slowly.";
    case Limiter::kSlew:
      return "The force changed as fast as is allowed.";
    case Limiter::kPower:
      return "The hand would have got more power than is allowed.";
  }
  return "";
}

glm::dvec3 ForceLedger::left_n() const noexcept {
  glm::dvec3 left = asked_n;
  for (const glm::dvec3& held : held_n) left -= held;
  return left;
}

}  // namespace palpate
