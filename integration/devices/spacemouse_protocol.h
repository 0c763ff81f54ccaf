#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

/// What a 3Dconnexion puck says. Its HID reports, little-endian: 1 = translation x y z (some models
/// append the rotation), 2 = rotation about x y z, 3 = buttons. Axes are the puck's own: x right,
/// y towards the user, z down, so that it is a rotation and no mirror to the world's axes.
namespace palpate::devices::spacemouse {

struct Model {
  uint16_t vendor, product;
  const char* name;
};
/// All that are known to speak so. Their maker's flat mice and keyboards are not among them.
std::span<const Model> models() noexcept;
/// Null if it is none of them.
const Model* model_of(uint16_t vendor, uint16_t product) noexcept;

/// How far the puck is pushed and turned at most; what is beyond is cut off.
inline constexpr int kFull = 350;

/// The puck's state, put together from reports. Plain state.
class Reports {
 public:
  /// False, and one more in rejected(), for what is no report that moves or presses something.
  bool read(std::span<const uint8_t> report) noexcept;

  /// x y z, then about x y z, in counts up to kFull.
  const std::array<int, 6>& axes() const noexcept { return axes_; }
  uint32_t buttons() const noexcept { return buttons_; }
  uint64_t rejected() const noexcept { return rejected_; }

 private:
  std::array<int, 6> axes_{};
  uint32_t buttons_ = 0;
  uint64_t rejected_ = 0;
};

/// A speed from three of the axes: zero up to `dead_zone` counts, full_speed at kFull, and the
/// square of the way between, so that small motions are fine ones. Keeps the direction; the result
/// is in the world's axes.
glm::dvec3 speed(std::span<const int, 3> axes, int dead_zone, double full_speed) noexcept;

}  // namespace palpate::devices::spacemouse
