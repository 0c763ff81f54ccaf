#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

#include "module/xr/hands.h"

namespace palpate::headset {

/// The hand that holds the probe when there is no force device.
struct ProbeHold {
  enum class By : uint8_t { kNobody, kController, kFinger } by = By::kNobody;
  int side = 1;                      ///< 0 left, 1 right
  glm::dvec3 tip_m{0.0};             ///< world
  uint32_t buttons = 0;              ///< of a controller: bit 0 is its trigger
  bool asks_for_tube = false;        ///< a finger's: it tapped
  bool asks_to_keep = false;         ///< a finger's: it tapped again soon after
  std::array<bool, 2> shown{};       ///< fingertips that are seen while no controller is there ...
  std::array<glm::dvec3, 2> tips{};  ///< ... and where, world
};

/// Picks the hand that feels. A controller does where one is there: the right one, or the left one
/// alone. Else the forefinger of a hand that pinches, for as long as it pinches; of two the first,
/// of two at once the right one. A pinch shorter than kTap_s, of either hand, asks for a stream
/// tube; another one of the same hand within kTwice_s, that the tubes are kept. A value; one
/// thread.
class ProbeHand {
 public:
  static constexpr double kTap_s = 0.3;
  static constexpr double kTwice_s = 0.5;  ///< from the end of a tap to the end of the next one

  /// Once per frame, dt_s after the one before.
  ProbeHold step(const xr::Hands& hands, double dt_s);

 private:
  std::array<double, 2> pinched_s_{};  ///< for so long by now; 0: not
  /// Since the tap that laid a tube; none: a tap would lay one.
  std::array<std::optional<double>, 2> since_tap_s_;
  std::optional<int> finger_;  ///< whose finger feels
};

}  // namespace palpate::headset
