// A simulated hand (0.554 kg, 6.45 N s/m, 135 N/m: Sci. Rep. srep18004, Fig. 3) leans, through a
// spring that is sampled at 1 kHz, on a wall that moves by itself. How much energy the tank passes,
// and its effect on the hand.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "module/haptics/guard/energy.h"

namespace palpate {
namespace {

constexpr double kTwoPi = 6.283185307179586;
constexpr double kStiffness = 1000.0, kFrameS = 1e-3;

/// Of a tool with one spring: where the proxy may go.
glm::dvec3 let(EnergyTank& tank, glm::dvec3 from, glm::dvec3 to, glm::dvec3 probe,
               double stiffness_n_per_m, double dt_s) {
  SpringMove spring{from, to, probe};
  tank.limit({&spring, 1}, stiffness_n_per_m, dt_s);
  return spring.to;
}

struct Outcome {
  double work_j = 0.0;         ///< of the force on the hand
  double steady_work_j = 0.0;  ///< of that, in the last 5 s: 6 whole beats at 1.2 Hz
  double most_force_n = 0.0;
  /// The largest amount by which a force step exceeds what the header guarantees.
  double beyond_n = -1e9;
  /// How far the surface has slipped past in the end.
  double surface_gap_m = 0.0;
  EnergyLedger ledger;
};

// The wall's surface is at amplitude * sin(2 pi hz t) and pushes towards +x; the hand rests at
// -lean. After a slip the surface carries the proxy on from where it is, as material does.
Outcome lean(double amplitude_m, double hz, double lean_m, const EnergyTankOptions& options,
             double seconds = 8.0) {
  EnergyTank tank(options);
  Outcome out;
  double probe = 0.0, v = 0.0, x = 0.0, wall = 0.0, force = 0.0;
  for (int i = 0; i * kFrameS < seconds; ++i) {
    const double before = probe;
    for (int sub = 0; sub < 20; ++sub) {
      v += kFrameS / 20 * (force - 6.45 * v - 135.0 * (probe + lean_m)) / 0.554;
      probe += kFrameS / 20 * v;
    }
    out.work_j += force * (probe - before);
    if (i >= 3000) out.steady_work_j += force * (probe - before);
    const double next = amplitude_m * std::sin(kTwoPi * hz * kFrameS * (i + 1));
    const bool touching = x <= wall + 1e-12 || out.surface_gap_m > 0.0;
    const double surface = touching ? x + (next - wall) : next;
    const double wanted = std::max(probe, surface);
    x = let(tank, {x, 0, 0}, {wanted, 0, 0}, {probe, 0, 0}, kStiffness, kFrameS).x;
    wall = next;
    out.surface_gap_m = x >= wall ? 0.0 : wall - x;
    const double now = kStiffness * (x - probe);
    const double without = std::abs(kStiffness * (wanted - probe) - force);
    const double may = std::max(without, kStiffness * std::abs(probe - before));
    out.beyond_n = std::max(out.beyond_n, std::abs(now - force) - may);
    out.most_force_n = std::max(out.most_force_n, now);
    force = now;
  }
  out.ledger = tank.ledger();
  return out;
}

TEST(EnergyTank, NeverBitesOnAHeart) {
  // Amplitudes up to 10 mm at 1.2 Hz, and a hand that leans with up to 2.7 N.
  for (double amplitude : {0.002, 0.005, 0.010})
    for (double rest : {0.0, 0.005, 0.010, 0.020}) {
      const Outcome out = lean(amplitude, 1.2, rest, {});
      EXPECT_EQ(out.ledger.slips, 0) << amplitude << " m, leaning " << rest << " m";
      EXPECT_EQ(out.ledger.refused_j, 0.0);
      EXPECT_GT(out.steady_work_j, 0.0);  // the wall does drive the hand
    }
}

TEST(EnergyTank, HoldsAViolentWallToItsAllowance) {
  const EnergyTankOptions options;
  for (double hz : {3.0, 6.0, 10.0})
    for (double amplitude : {0.02, 0.05}) {
      const Outcome free = lean(amplitude, hz, 0.01, {1e3, 1e3, 1.0});
      const Outcome held = lean(amplitude, hz, 0.01, options);
      const double may = options.capacity_j + options.allowance_w * 8.0;
      EXPECT_EQ(free.ledger.slips, 0);
      EXPECT_GT(held.ledger.slips, 0) << hz << " Hz, " << amplitude << " m";
      // The guarantee in the header, with the work on the hand.
      EXPECT_LE(held.work_j, may + held.ledger.sampling_j + 1e-9)
          << hz << " Hz, " << amplitude << " m";
      EXPECT_GT(free.work_j, may + free.ledger.sampling_j) << hz << " Hz, " << amplitude << " m";
      // Slipping makes no jump of the force.
      EXPECT_LE(held.beyond_n, 1e-9) << hz << " Hz, " << amplitude << " m";
    }
}

TEST(EnergyTank, TakesHoldOfTheHandAgainWhenTheWallCalmsDown) {
  // A hard push empties the tank and the surface slips. With the wall at rest again, the proxy
  // stays.
  EnergyTank tank({0.005, 0.05, 1.0});
  glm::dvec3 x(0.0), probe(0.0);
  for (int i = 0; i < 20; ++i) x = let(tank, x, x + glm::dvec3(1e-3, 0, 0), probe, 1000.0, 1e-3);
  EXPECT_TRUE(tank.slipped());
  const glm::dvec3 held = x;
  for (int i = 0; i < 100; ++i) {
    x = let(tank, x, x, probe, 1000.0, 1e-3);
    ASSERT_EQ(x, held);
    ASSERT_FALSE(tank.slipped());
  }
  EXPECT_NEAR(tank.energy_j(), 0.005, 1e-9);
}

}  // namespace
}  // namespace palpate
