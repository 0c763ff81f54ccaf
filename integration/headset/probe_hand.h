#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

#include "module/xr/hands.h"

namespace palpate::headset {

/// The hand that holds the probe if there is no force device.
struct ProbeHold {
  enum class By : uint8_t { kNobody, kController, kFinger } by = By::kNobody;
  int side = 1;                ///< 0 left, 1 right
  glm::dvec3 tip_m{0.0};       ///< world
  uint32_t buttons = 0;        ///< of a controller: bit 0 is its trigger
  bool asks_for_tube = false;  ///< a finger tapped
  bool asks_to_keep = false;   ///< a finger tapped again soon after
  /// Fingertips that are visible without a controller, and their places, world.
  std::array<bool, 2> shown{};
  std::array<glm::dvec3, 2> tips{};
};

/// Chooses the hand that moves the probe. If there are controllers: the right one, or the left one
/// alone. Otherwise the forefinger of a hand that pinches, while it pinches; of two hands the
/// first, of two at once the right one. A pinch of either hand shorter than kTap_s asks for a
/// stream tube; another one of the same hand within kTwice_s asks to keep the tubes. A value; one
/// thread.
class ProbeHand {
 public:
  static constexpr double kTap_s = 0.3;
  static constexpr double kTwice_s = 0.5;  ///< from the end of a tap to the end of the next one

  /// Once per frame, dt_s after the one before.
  ProbeHold step(const xr::Hands& hands, double dt_s);

 private:
  std::array<double, 2> pinched_s_{};  ///< duration of the present pinch; 0: none
  /// Time since the tap that released a tube; empty: the next tap releases one.
  std::array<std::optional<double>, 2> since_tap_s_;
  std::optional<int> finger_;  ///< side of the finger that moves the probe
};

}  // namespace palpate::headset
