#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include <fmt/format.h>

#include "integration/devices/held_mass.h"
#include "module/haptics/delay_lead.h"
#include "tests/bench/haptics_bench.h"
#include "tests/bench/haptics_bench_scenes.h"
#include "tests/bench/stability_grid.h"

namespace palpate::bench {
namespace {

constexpr double kFrame_s = 1e-3;

struct Cycles {
  int runs = 0, found = 0;
  double percent() const { return 100.0 * found / std::max(1, runs); }
};

Cycles cycles(int runs, double c, double share, unsigned threads) {
  Cycles cycles{runs, 0};
  for (const auto& run : test::run_stability_grid(runs, 0, c, share, threads))
    cycles.found += run.result.limit_cycle;
  return cycles;
}

void limit_cycles(const HapticsBench& bench, Findings& findings) {
  for (const double c : {0.9, 0.98}) {
    const Cycles lead = cycles(bench.stability_runs, c, DelayLead::kShare, bench.threads);
    const Cycles plain = cycles(std::max(1, bench.stability_runs / 5), c, 0.0, bench.threads);
    findings.goals.push_back(
        {fmt::format("limit cycles at K = {} b / (T/2 + delay), seeded grid", c), "", "runs",
         c < 0.95 ? std::optional(0.0) : std::nullopt, c < 0.95 ? std::nullopt : std::optional(0.0),
         double(lead.found), 0,
         fmt::format("of {} runs; the plain loop {:.1f} % of {}", lead.runs, plain.percent(),
                     plain.runs)});
  }
}

/// What a wall that moves by itself does to a hand that leans on it.
struct Lean {
  double amplitude_m, hz;  ///< of its swing
};

/// Work on the hand beyond what the tank's header promises: capacity, allowance, what sampling
/// made and what the spring held at the start (nothing). J.
double beyond_tank(const Lean& lean, const std::shared_ptr<const MovingVolume>& data, bool meter,
                   double seconds) {
  HapticsOptions options = bare();
  options.meter_energy = meter;
  SceneSpec spec = test::shell_spec(50.0, 0.0, 1000.0);
  DriveSpec& drive = spec.volumes.front().drive;
  drive.kind = DriveSpec::Kind::kSwing;
  drive.axis = {1.0, 0.0, 0.0};
  drive.rate_hz = lean.hz;
  drive.amplitude_m = lean.amplitude_m;
  spec.volumes.front().path = PosePath::kExact;
  test::Hand hand(spec, {data}, options);
  devices::MassProperties body;
  body.mass_kg = 0.15;
  body.hand = devices::kHumanHand;
  const glm::dvec3 start(0.030, 0.003, 0.0), meant(0.020, 0.003, 0.0);
  devices::HeldMass mass(body, start);
  double work_j = 0.0, held_j = 0.0, most_j = 0.0;
  glm::dvec3 force(0.0);
  for (int i = 0; i < int(seconds / kFrame_s); ++i) {
    const glm::dvec3 before = mass.position_m();
    mass.advance(kFrame_s, force, i ? meant : start, meant);
    const glm::dvec3 moved = mass.position_m() - before;
    work_j += glm::dot(force, moved);
    held_j += 0.5 * spec.stiffness_n_per_m * glm::dot(moved, moved);
    const double may = options.tank.capacity_j + options.tank.allowance_w * kFrame_s * (i + 1);
    most_j = std::max(most_j, work_j - may - held_j);
    force = hand.to(mass.position_m()).wanted_n;
  }
  return most_j;
}

void energy(const HapticsBench& bench, Findings& findings) {
  double with = 0.0, without = 0.0;
  int scenes = 0;
  const double seconds = bench.quick ? 2.0 : 10.0;
  for (const auto& data : {test::shell(1, 1.0), test::shell(4, 4.0), test::shell(4, 20.0)})
    for (const double amplitude_m : {0.005, 0.02, 0.05})
      for (const double hz : {1.2, 3.0, 6.0, 10.0}) {
        const Lean lean{amplitude_m, hz};
        with = std::max(with, beyond_tank(lean, data, true, seconds));
        without = std::max(without, beyond_tank(lean, data, false, seconds));
        ++scenes;
      }
  findings.goals.push_back(
      {"energy that a moving scene makes beyond the tank",
       "unbounded",
       "J",
       1e-6,
       {},
       with,
       9,
       fmt::format("without the tank {:.3f}; {} scenes, wall to 50 mm at 10 Hz", without, scenes)});
}

}  // namespace

Findings stability_rows(const HapticsBench& bench) {
  Findings findings;
  limit_cycles(bench, findings);
  energy(bench, findings);
  return findings;
}

}  // namespace palpate::bench
