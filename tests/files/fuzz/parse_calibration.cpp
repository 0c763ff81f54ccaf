#include <cmath>

#include "integration/files/scene/calibration_file.h"
#include "tests/files/fuzz/parse_bytes.h"
#include "tests/support/require.h"

namespace palpate::files::fuzz {
namespace {

bool finite(glm::dvec3 v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace

void parse_calibration_file(std::string_view bytes) {
  const auto stored = parse_calibration("folder/fuzz.json", bytes);
  if (!stored) {
    require(stored.error().message.find(": ") != std::string::npos, "an error says what to do");
    return;
  }
  const Calibration& c = stored->calibration;
  require(finite(c.stage_from_device.position_m), "the device has a place");
  require(std::abs(glm::length(c.stage_from_device.rotation) - 1.0) < 1e-9, "it is turned");
  require(c.rms_m >= 0.0 && std::isfinite(c.rms_m), "an error is not below 0");
  require(c.used >= 0 && c.all >= 0, "counts are not below 0");
  require(std::isfinite(c.delay_s) && finite(c.controller_from_tip_m), "numbers are finite");
  require(stored->space == "stage" || stored->space == "local", "a space that exists");
}

}  // namespace palpate::files::fuzz
