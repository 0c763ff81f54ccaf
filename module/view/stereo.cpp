#include "module/view/stereo.h"

#include <algorithm>
#include <cstddef>
#include <glm/glm.hpp>

namespace palpate {
namespace {

/// Light of a screen through red and cyan glasses: what each eye's linear R, G and B give to the
/// picture's. Columns as glm has them.
constexpr glm::mat3 kOfLeft(0.437, -0.062, -0.048, 0.449, -0.062, -0.050, 0.164, -0.024, -0.017);
constexpr glm::mat3 kOfRight(-0.011, 0.377, -0.026, -0.032, 0.761, -0.093, -0.007, 0.009, 1.234);

Picture side_by_side(const Picture& left, const Picture& right) {
  Picture both{left.width + right.width, left.height, {}, {}};
  const auto add = [&](const auto& from, int width, int row, auto& into) {
    if (from.empty()) return;
    const auto begin = from.begin() + ptrdiff_t(row) * width;
    into.insert(into.end(), begin, begin + width);
  };
  for (int row = 0; row < left.height; ++row) {
    add(left.colours, left.width, row, both.colours);
    add(right.colours, right.width, row, both.colours);
    add(left.depths, left.width, row, both.depths);
    add(right.depths, right.width, row, both.depths);
  }
  return both;
}

Picture anaglyph(const Picture& left, const Picture& right) {
  Picture both = left;
  for (size_t i = 0; i < both.colours.size() && i < right.colours.size(); ++i) {
    const glm::vec3 light =
        kOfLeft * light_of(left.colours[i]) + kOfRight * light_of(right.colours[i]);
    both.colours[i] = colour_of(light, std::max(left.colours[i] >> 24, right.colours[i] >> 24));
  }
  return both;
}

}  // namespace

Picture joined(const std::array<Picture, 2>& eyes, Stereo stereo) {
  switch (stereo) {
    case Stereo::kMono:
      return eyes[0];
    case Stereo::kParallel:
      return side_by_side(eyes[0], eyes[1]);
    case Stereo::kCrossed:
      return side_by_side(eyes[1], eyes[0]);
    case Stereo::kAnaglyph:
      return anaglyph(eyes[0], eyes[1]);
  }
  return eyes[0];
}

}  // namespace palpate
