#include "module/view/picture.h"

#include <array>
#include <cmath>

#include "module/scene/look.h"

namespace palpate {
namespace {

// Tables: a picture has millions of values, and a power takes as long as a hundred additions.
constexpr int kSteps = 4096;  // of light; dark colours differ by 1 / 3295

const std::array<float, 256>& lights() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> made{};
    for (size_t i = 0; i < made.size(); ++i) made[i] = float(linear_from_srgb(double(i) / 255.0));
    return made;
  }();
  return table;
}

const std::array<uint8_t, kSteps + 1>& encoded() {
  static const std::array<uint8_t, kSteps + 1> table = [] {
    std::array<uint8_t, kSteps + 1> made{};
    for (size_t i = 0; i < made.size(); ++i) {
      const double v = double(i) / kSteps;
      const double e = v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055;
      made[i] = uint8_t(std::lround(255.0 * e));
    }
    return made;
  }();
  return table;
}

}  // namespace

glm::vec3 light_of(uint32_t colour) {
  const auto& table = lights();
  return {table[colour & 255U], table[colour >> 8 & 255U], table[colour >> 16 & 255U]};
}

uint32_t colour_of(glm::vec3 light, uint32_t coverage) {
  const glm::uvec3 at(glm::clamp(light, 0.0F, 1.0F) * float(kSteps) + 0.5F);
  const auto& table = encoded();
  return uint32_t(table[at.x]) | uint32_t(table[at.y]) << 8 | uint32_t(table[at.z]) << 16 |
         coverage << 24;
}

}  // namespace palpate
