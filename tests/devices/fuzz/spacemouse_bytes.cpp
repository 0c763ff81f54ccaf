#include "tests/devices/fuzz/spacemouse_bytes.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "integration/devices/spacemouse_protocol.h"
#include "tests/support/require.h"

namespace palpate::devices::fuzz {
void read_spacemouse_bytes(std::string_view bytes) {
  spacemouse::Reports reports;
  uint64_t refused = 0;
  for (size_t at = 0; at < bytes.size();) {
    // One report in a buffer of its own, so that the address sanitizer detects a read of one byte
    // too many.
    const size_t count = std::min<size_t>(uint8_t(bytes[at]) % 16, bytes.size() - at);
    const std::vector<uint8_t> report(bytes.begin() + long(at), bytes.begin() + long(at + count));
    const auto before = reports.axes();
    const uint32_t buttons = reports.buttons();
    if (!reports.read(report)) {
      ++refused;
      require(reports.axes() == before && reports.buttons() == buttons,
              "what is refused changes nothing");
    }
    at += count + 1;
    for (const int axis : reports.axes())
      require(std::abs(axis) <= spacemouse::kFull, "axes are cut off");
    const auto axes = std::span(reports.axes());
    const glm::dvec3 speed = spacemouse::speed(axes.first<3>(), 10, 0.2);
    require(glm::length(speed) <= 0.2 * (1.0 + 1e-12), "a speed is bounded");
    require(std::isfinite(speed.x + speed.y + speed.z), "a speed is a number");
  }
  require(reports.rejected() == refused, "what is refused is counted");
}

}  // namespace palpate::devices::fuzz
