// Oracle: a ledger in long double that computes the energy of each frame from the positions alone,
// and the work on the hand as the sum of f.dp, which uses no spring energy. Also: a motion of the
// proxy is cut short exactly where the energy in the tank ends, and never elsewhere.
#include "module/haptics/guard/energy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/random.h"

namespace palpate {
namespace {

using test::Random;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
// Doubles of positions below 1 m, and products of them with k up to 3,000 N/m: rounding is about
// 1e-13 J at most per frame, and does not add up in one direction.
constexpr double kRounding = 1e-12;

long double spring(double k, glm::dvec3 x, glm::dvec3 p) {
  const long double a = (long double)(x.x) - p.x, b = (long double)(x.y) - p.y,
                    c = (long double)(x.z) - p.z;
  return 0.5L * k * (a * a + b * b + c * c);
}

/// Of a tool with one spring: where the proxy may go.
glm::dvec3 limit(EnergyTank& tank, glm::dvec3 from, glm::dvec3 to, glm::dvec3 probe,
                 double stiffness_n_per_m, double dt_s) {
  SpringMove spring{from, to, probe};
  tank.limit({&spring, 1}, stiffness_n_per_m, dt_s);
  return spring.to;
}

EnergyTankOptions options(double capacity_j, double allowance_w, double share) {
  EnergyTankOptions o;
  o.capacity_j = capacity_j;
  o.allowance_w = allowance_w;
  o.dissipated_share = share;
  return o;
}

TEST(EnergyTank, LetsPassWhatItCanPayAndBooksIt) {
  EnergyTank tank(options(0.1, 0.0, 0.0));
  // 600 N/m stretched from 0 to 10 mm: 30 mJ.
  const glm::dvec3 x = limit(tank, {0, 0, 0}, {0.01, 0, 0}, {0, 0, 0}, 600.0, 1e-3);
  EXPECT_EQ(x, glm::dvec3(0.01, 0, 0));
  EXPECT_FALSE(tank.slipped());
  EXPECT_NEAR(tank.last_j(), 0.03, kRounding);
  EXPECT_NEAR(tank.energy_j(), 0.07, kRounding);
  EXPECT_NEAR(tank.ledger().put_in_j, 0.03, kRounding);
}

TEST(EnergyTank, GivesTheLargestShareThatItCanPay) {
  EnergyTank tank(options(0.03, 0.0, 0.0));
  // 600 N/m to 20 mm would cost 120 mJ; 30 mJ are enough for half the way.
  const glm::dvec3 x = limit(tank, {0, 0, 0}, {0.02, 0, 0}, {0, 0, 0}, 600.0, 1e-3);
  EXPECT_NEAR(x.x, 0.01, kRounding);
  EXPECT_TRUE(tank.slipped());
  EXPECT_NEAR(tank.energy_j(), 0.0, kRounding);
  EXPECT_NEAR(tank.ledger().refused_j, 0.09, kRounding);
  EXPECT_EQ(tank.ledger().slips, 1);
}

TEST(EnergyTank, HoldsTheSurfaceWhereItIsWhenEmpty) {
  EnergyTank tank(options(0.0, 0.0, 0.0));
  const glm::dvec3 x_prev(0.002, 0.001, 0), probe(0, 0, 0);
  EXPECT_EQ(limit(tank, x_prev, {0.004, 0.002, 0}, probe, 1000.0, 1e-3), x_prev);
  // Along a circle about the probe the motion costs no energy; away from the probe it does.
  const glm::dvec3 round(-0.001, 0.002, 0);
  EXPECT_EQ(limit(tank, x_prev, round, probe, 1000.0, 1e-3), round);
  // A way that enters the sphere and leaves it again is cut where it leaves.
  const glm::dvec3 out = limit(tank, {0.002, 0, 0}, {-0.006, 0, 0}, probe, 1000.0, 1e-3);
  EXPECT_NEAR(out.x, -0.002, kRounding);
  EXPECT_EQ(out.y, 0.0);
}

TEST(EnergyTank, IsChargedByTheAllowanceUpToItsCapacity) {
  EnergyTank tank(options(0.01, 0.05, 0.0));
  const glm::dvec3 o(0.0);
  // Would cost 50 mJ: empties the tank.
  limit(tank, o, {0.01, 0, 0}, o, 1000.0, 1e-9);
  EXPECT_NEAR(tank.energy_j(), 0.0, kRounding);
  for (int i = 0; i < 100; ++i) limit(tank, o, o, o, 1000.0, 1e-3);
  // 50 mW for 0.1 s, less the nanosecond above.
  EXPECT_NEAR(tank.energy_j(), 0.005, 1e-9);
  for (int i = 0; i < 1000; ++i) limit(tank, o, o, o, 1000.0, 1e-3);
  EXPECT_DOUBLE_EQ(tank.energy_j(), 0.01);
  for (double dt : {0.0, -1.0, kNan, kInf}) {
    const double before = tank.energy_j();
    limit(tank, o, {1e-4, 0, 0}, o, 1000.0, dt);  // 5 uJ
    EXPECT_NEAR(tank.energy_j(), before - 5e-6, kRounding) << dt;
  }
}

TEST(EnergyTank, IsChargedByItsShareOfWhatYielded) {
  for (double share : {0.0, 0.3, 1.0}) {
    EnergyTank tank(options(1.0, 0.0, share));
    const glm::dvec3 o(0.0);
    limit(tank, o, {0.02, 0, 0}, o, 1000.0, 1e-3);             // 200 mJ in
    limit(tank, {0.02, 0, 0}, {0.01, 0, 0}, o, 1000.0, 1e-3);  // 150 mJ out
    EXPECT_NEAR(tank.energy_j(), 0.8 + share * 0.15, kRounding) << share;
    EXPECT_NEAR(tank.ledger().dissipated_j, 0.15, kRounding);
    EXPECT_NEAR(tank.ledger().charged_j, share * 0.15, kRounding);
  }
}

TEST(EnergyTank, ChargesNothingInFreeMotion) {
  // The proxy follows the probe: the "loss" of each frame comes from sampling, not from the hand.
  EnergyTank tank(options(0.05, 0.0, 1.0));
  const glm::dvec3 o(0.0);
  limit(tank, o, {0.02, 0, 0}, o, 1000.0, 1e-3);
  ASSERT_LT(tank.energy_j(), kRounding);
  tank.restart();
  glm::dvec3 x(0.0);
  Random random(3);
  for (int i = 0; i < 10000; ++i) {
    const glm::dvec3 probe = x + random.vector(1e-3);
    ASSERT_EQ(limit(tank, x, probe, probe, 1000.0, 1e-3), probe);
    x = probe;
  }
  EXPECT_LT(tank.energy_j(), kRounding);
  EXPECT_NEAR(tank.ledger().sampling_j, tank.ledger().dissipated_j,
              1e-3 * tank.ledger().sampling_j);
}

TEST(EnergyTank, LeavesAStillSceneAlone) {
  // Pressing into a wall that holds: the proxy stays, wherever the hand goes, so no energy is
  // counted.
  EnergyTank tank(options(0.1, 0.0, 1.0));
  const glm::dvec3 wall(0.01, 0.02, 0.03);
  Random random(4);
  for (int i = 0; i < 1000; ++i)
    ASSERT_EQ(limit(tank, wall, wall, wall + random.vector(0.01), 800.0, 1e-3), wall);
  EXPECT_EQ(tank.energy_j(), 0.1);
  EXPECT_EQ(tank.ledger().put_in_j, 0.0);
  EXPECT_EQ(tank.ledger().dissipated_j, 0.0);
  EXPECT_EQ(tank.ledger().charged_j, 0.0);
}

TEST(EnergyTank, BooksAChangeOfStiffness) {
  EnergyTank tank(options(0.1, 0.0, 1.0));
  const glm::dvec3 x(0.01, 0, 0), o(0.0);
  limit(tank, x, x, o, 400.0, 1e-3);
  // Half of 600 N/m more, times (10 mm)^2: 30 mJ.
  EXPECT_EQ(limit(tank, x, x, o, 1000.0, 1e-3), x);
  EXPECT_NEAR(tank.last_j(), 0.03, kRounding);
  EXPECT_NEAR(tank.energy_j(), 0.07, kRounding);
  limit(tank, x, x, o, 400.0, 1e-3);
  EXPECT_NEAR(tank.energy_j(), 0.1, kRounding);
}

TEST(EnergyTank, DrawsTheProxyInWhereAStifferSpringCanNotBePaid) {
  EnergyTank tank(options(0.0, 0.0, 0.0));
  const glm::dvec3 x(0.01, 0, 0), o(0.0);
  limit(tank, x, x, o, 400.0, 1e-3);
  // Equal energy in a spring of four times the stiffness: half the stretch.
  EXPECT_NEAR(limit(tank, x, x, o, 1600.0, 1e-3).x, 0.005, kRounding);
  EXPECT_NEAR(tank.last_j(), 0.0, kRounding);
  // A way that is outside all along, and one that would enter only beyond its end, do not change
  // this.
  for (const glm::dvec3 to : {glm::dvec3(0.01, 0.005, 0), glm::dvec3(0.0099, 0, 0)}) {
    EnergyTank other(options(0.0, 0.0, 0.0));
    limit(other, x, x, o, 400.0, 1e-3);
    EXPECT_NEAR(limit(other, x, to, o, 1600.0, 1e-3).x, 0.005, kRounding);
  }
}

TEST(EnergyTank, HoldsWhatItGetsWhenSomethingIsNotFinite) {
  const glm::dvec3 x(0.01, 0, 0), y(0.02, 0, 0), o(0.0);
  for (double bad : {kNan, kInf, -kInf}) {
    EnergyTank tank;
    EXPECT_EQ(limit(tank, x, {bad, 0, 0}, o, 600.0, 1e-3), x);
    EXPECT_EQ(limit(tank, x, y, {0, bad, 0}, 600.0, 1e-3), x);
    EXPECT_EQ(limit(tank, x, y, o, bad, 1e-3), x);
    EXPECT_EQ(limit(tank, x, y, o, 0.0, 1e-3), x);
    EXPECT_EQ(limit(tank, x, {1e200, 0, 0}, o, 600.0, 1e-3), x);
    EXPECT_EQ(tank.energy_j(), EnergyTankOptions{}.capacity_j);
    EXPECT_EQ(tank.ledger().put_in_j, 0.0);
    EXPECT_EQ(limit(tank, x, x, o, 600.0, 1e-3), x);
  }
  EXPECT_EQ(EnergyTank(options(kNan, -1.0, kInf)).energy_j(), 0.0);
}

// One frame of a random run: hand and scene move at random, sometimes not at all.
struct Session {
  explicit Session(uint32_t seed) : random(seed) { k = random.draw(100.0, 3000.0); }
  void hand() {
    if (random.draw(0, 1) < 0.7) probe += random.vector(2e-3);
  }
  glm::dvec3 scene() {
    const double what = random.draw(0, 1);
    if (what < 0.02) k = random.draw(100.0, 3000.0);
    if (what < 0.3) return x;
    if (what < 0.5) return probe;
    if (what < 0.6) return x + random.vector(2e-2);
    return x + random.vector(1e-3) + 0.05 * (probe - x);
  }
  Random random;
  double k;
  glm::dvec3 x{0.0}, probe{0.0};
};

TEST(EnergyTank, NeverPaysMoreThanItGot) {
  for (uint32_t seed = 1; seed <= 200; ++seed) {
    Session run(seed);
    const double capacity = run.random.draw(0.0, 0.05), share = run.random.draw(0.0, 1.0);
    EnergyTank tank(options(capacity, run.random.draw(0.0, 0.2), share));
    long double put_in = 0.0L;
    for (int frame = 0; frame < 2000; ++frame) {
      run.hand();
      const double old_k = run.k;
      const glm::dvec3 want = run.scene();
      const glm::dvec3 got = limit(tank, run.x, want, run.probe, run.k, 1e-3);
      const long double joule =
          spring(run.k, got, run.probe) - spring(frame == 0 ? run.k : old_k, run.x, run.probe);
      put_in += joule > 0.0L ? joule : 0.0L;
      ASSERT_NEAR(double(joule), tank.last_j(), kRounding) << "seed " << seed << " frame " << frame;
      ASSERT_GE(tank.energy_j(), 0.0) << seed;
      ASSERT_LE(tank.energy_j(), capacity) << seed;
      // For the same probe, the force step with the tank is not larger than the one without it, and
      // has its direction.
      if (run.k == old_k) {
        const glm::dvec3 whole = want - run.x, part = got - run.x;
        ASSERT_LE(glm::length(part), glm::length(whole) * (1.0 + 1e-12)) << seed;
        ASSERT_NEAR(glm::length(glm::cross(part, whole)), 0.0, kRounding) << seed;
      }
      run.x = got;
    }
    const EnergyLedger ledger = tank.ledger();
    EXPECT_NEAR(double(put_in), ledger.put_in_j, kRounding * (1.0 + double(put_in))) << seed;
    EXPECT_LE(ledger.put_in_j, (capacity + ledger.charged_j) * (1.0 + kRounding) + kRounding)
        << "seed " << seed;
    EXPECT_NEAR(tank.energy_j(), capacity + ledger.charged_j - ledger.put_in_j,
                kRounding * (1.0 + ledger.put_in_j))
        << "seed " << seed;
  }
}

TEST(EnergyTank, RefusesNoMoreThanItMust) {
  // After a slip the tank is empty, and a slightly longer step would have overdrawn it.
  int slips = 0;
  for (uint32_t seed = 1; seed <= 200; ++seed) {
    Session run(seed);
    EnergyTank tank(options(0.002, 0.05, 0.5));
    for (int frame = 0; frame < 500; ++frame) {
      run.hand();
      const double old_k = run.k;
      const glm::dvec3 want = run.scene();
      const glm::dvec3 got = limit(tank, run.x, want, run.probe, run.k, 1e-3);
      if (tank.slipped() && run.k == old_k) {
        ++slips;
        ASSERT_NEAR(tank.energy_j(), 0.0, kRounding) << "seed " << seed << " frame " << frame;
        const glm::dvec3 further = got + 1e-3 * (want - got);
        ASSERT_GT(spring(run.k, further, run.probe), spring(run.k, got, run.probe)) << seed;
      } else if (!tank.slipped()) {
        ASSERT_EQ(got, want) << seed;
      }
      run.x = got;
    }
  }
  EXPECT_GT(slips, 1000);
}

TEST(EnergyTank, LedgerBalancesWithTheWorkDoneOnTheHand) {
  for (uint32_t seed = 1; seed <= 100; ++seed) {
    Session run(seed);
    EnergyTank tank(options(0.01, 0.05, 1.0));
    long double work = 0.0L;
    glm::dvec3 force(0.0), last = run.probe;
    double allowed = 0.0;
    for (int frame = 0; frame < 2000; ++frame) {
      if (frame > 0) run.hand();
      const glm::dvec3 moved = run.probe - last;
      for (int a = 0; a < 3; ++a) work += (long double)(force[a]) * moved[a];
      last = run.probe;
      const glm::dvec3 want = run.scene();
      run.x = limit(tank, run.x, want, run.probe, run.k, 1e-3);
      allowed += 0.05 * 1e-3;
      force = run.k * (run.x - run.probe);
    }
    const EnergyLedger ledger = tank.ledger();
    const double left = double(spring(run.k, run.x, run.probe));
    // Sums of terms that cancel, about 1,000 J in total: 1e-9 J is 1e-12 of them.
    EXPECT_NEAR(double(work), ledger.put_in_j - ledger.dissipated_j + ledger.sampling_j - left,
                1e-9)
        << "seed " << seed;
    // The scene alone can not give more than the tank and the allowance; the rest comes from
    // sampling.
    EXPECT_LE(double(work), 0.01 + allowed + ledger.sampling_j + 1e-9) << "seed " << seed;
  }
}

}  // namespace
}  // namespace palpate
