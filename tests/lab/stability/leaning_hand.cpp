#include "tests/lab/stability/leaning_hand.h"

#include <algorithm>

#include "integration/devices/held_mass.h"
#include "tests/lab/stability/shell.h"

namespace palpate::stability {
namespace {

constexpr double kFrame_s = 1e-3;

devices::MassProperties held_body() {
  devices::MassProperties body;
  body.mass_kg = 0.15;
  body.hand = devices::kHumanHand;
  return body;
}

}  // namespace

double leaning_damping_n_s_per_m() {
  const devices::MassProperties body = held_body();
  return body.damping_n_s_per_m + body.hand.damping_n_s_per_m;
}

LeaningResult lean(const LeaningCase& at, bool metered) {
  return lean(at, metered,
              at.beats_hz > 0.0 ? shell(4, 4.0 * at.beats_hz, Made::kAnalytic, 2.0)
                                : shell(1, 1.0, Made::kAnalytic, 2.0));
}

LeaningResult lean(const LeaningCase& at, bool metered,
                   const std::shared_ptr<const MovingVolume>& data) {
  HapticsOptions options = unmetered();
  options.meter_energy = metered;
  SceneSpec spec = shell_spec(50.0, 0.0, at.stiffness_n_per_m);
  if (at.amplitude_m > 0.0) {
    DriveSpec& drive = spec.volumes.front().drive;
    drive.kind = DriveSpec::Kind::kSwing;
    drive.axis = {1.0, 0.0, 0.0};
    drive.rate_hz = at.swing_hz;
    drive.amplitude_m = at.amplitude_m;
    spec.volumes.front().path = PosePath::kExact;
  }
  Hand hand(spec, {data}, options);
  const glm::dvec3 start(0.030, 0.003, 0.0), meant(0.020, 0.003, 0.0);
  devices::HeldMass mass(held_body(), start);
  double work_j = 0.0, sampling_j = 0.0;
  LeaningResult result;
  glm::dvec3 force(0.0);
  for (int i = 0; i < int(at.seconds / kFrame_s); ++i) {
    const glm::dvec3 before = mass.position_m();
    mass.advance(kFrame_s, force, i ? meant : start, meant);
    const glm::dvec3 moved = mass.position_m() - before;
    work_j += glm::dot(force, moved);
    sampling_j += 0.5 * spec.stiffness_n_per_m * glm::dot(moved, moved);
    const double may = options.tank.capacity_j + options.tank.allowance_w * kFrame_s * (i + 1);
    result.beyond_j = std::max(result.beyond_j, work_j - may - sampling_j);
    force = hand.to(mass.position_m()).wanted_n;
  }
  result.refused_j = hand.haptics.tank().ledger().refused_j;
  return result;
}

}  // namespace palpate::stability
