#include "integration/devices/calibration_hand.h"

#include <cmath>

#include "module/haptics/servo/monotonic.h"

namespace palpate::devices {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr glm::dvec3 kWide_m{0.060, 0.045, 0.030};  // no corner of it is out of reach
constexpr glm::dvec3 kRate_hz{0.31, 0.43, 0.57};    // without a common period that matters

}  // namespace

glm::dvec3 CalibrationHand::wander_m(int64_t monotonic_ns) noexcept {
  const double t = 1e-9 * double(monotonic_ns);
  glm::dvec3 place;
  for (int a = 0; a < 3; ++a) place[a] = kWide_m[a] * std::sin(2.0 * kPi * kRate_hz[a] * t + a);
  return place;
}

DeviceInfo CalibrationHand::info() const {
  DeviceInfo info;
  info.kind = "simulated";
  info.name = "simulated device";
  info.max_force_n = 9.0;
  info.workspace_radius_m = kReach_m;
  info.actuated_dof = 0;
  return info;
}

DeviceReading CalibrationHand::exchange(const DeviceCommand&) noexcept {
  DeviceReading reading;
  reading.time_ns = monotonic_ns();
  // After the time was read: a reading later than go_to() is at its place.
  places_.get(place_m_);
  reading.position_m = wanders_ ? wander_m(reading.time_ns) : place_m_;
  reading.fresh = true;
  return reading;
}

}  // namespace palpate::devices
