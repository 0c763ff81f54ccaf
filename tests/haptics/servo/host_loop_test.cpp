// The loop of a host that calls the ticks itself. Oracles: the servo loop with the same positions
// at the same times, and the largest step of a safe force between two ticks.
#include "module/haptics/servo/host_loop.h"

#include <gtest/gtest.h>

#include <limits>

#include "module/haptics/scene_ticker.h"
#include "tests/haptics/servo/servo_fakes.h"
#include "tests/haptics/shell_scene.h"

namespace palpate {
namespace {

using namespace test;

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kStart_ns = 5'000'000'000;  // of FakeClock
// The largest of SafetyOptions' ramps, with some margin.
constexpr double kSteepest_n_per_ms = 0.6;

/// The hand's place: from free space some mm into the wall of the shell, which is 25 mm from the
/// middle.
glm::dvec3 hand_at(int64_t time_ns) {
  const double t_s = 1e-9 * double(time_ns - kStart_ns);
  const double r_m = 0.035 - 0.013 * std::min(1.0, t_s / 0.5) + 0.001 * std::sin(9.0 * t_s);
  return r_m * glm::normalize(glm::dvec3(0.6, 0.5, -0.4));
}

struct Bench {
  explicit Bench(int frames = 1) : ticker(HapticsOptions{}, Hand::device()) {
    auto scene = plan(shell_spec(4.0, 0.2, 600.0), {shell(frames, 4.0)});
    EXPECT_TRUE(scene);
    EXPECT_TRUE(ticker.offer(*scene));
  }
  glm::dvec3 to(glm::dvec3 position_m, int64_t passed_ns = kMs) {
    time_ns += passed_ns;
    return loop.tick({position_m, time_ns, 0});
  }
  /// Moves into free space, which ends a latched cause, and back.
  double leave_and_come_back() {
    double worst_n = 0.0;
    for (int k = 0; k < 4000; ++k) {
      const double away_m = 0.013 * std::min({1.0, k / 500.0, (4000.0 - k) / 500.0});
      const glm::dvec3 x = hand_at(time_ns + kMs);
      const glm::dvec3 now_n = to(x + away_m * glm::normalize(x));
      worst_n = std::max(worst_n, glm::length(now_n - force_n));
      force_n = now_n;
    }
    return std::max(worst_n, go(1000));
  }
  /// Runs for a time and returns the largest change from one tick to the next, N.
  double go(int ticks, int64_t passed_ns = kMs) {
    double worst_n = 0.0;
    for (int k = 0; k < ticks; ++k) {
      const glm::dvec3 now_n = to(hand_at(time_ns + passed_ns), passed_ns);
      worst_n = std::max(worst_n, glm::length(now_n - force_n));
      force_n = now_n;
    }
    return worst_n;
  }
  TickOutput last() {
    TickOutput output;
    loop.newest(0, output);
    return output;
  }

  SceneTicker ticker;
  HostLoop loop{ticker, Hand::device()};
  int64_t time_ns = kStart_ns;
  glm::dvec3 force_n{0.0};
};

TEST(HostLoop, GivesTheForcesOfTheServoLoopBitByBit) {
  Bench host(4), of_servo(4);
  FakeClock clock;
  FakeDevice device(clock);
  device.takes_ns = 0;
  device.answer = [&](DeviceReading& reading) { reading.position_m = hand_at(clock.now); };
  ServoPorts ports;
  LoopOptions options;
  options.exchanges = Exchanges::kTwice;
  ServoLoop loop(device, of_servo.ticker, clock, ports, options);
  double most_n = 0.0;
  for (int k = 0; k < 2000; ++k) {
    ASSERT_TRUE(loop.run_period());
    const glm::dvec3 force_n = host.to(hand_at(host.time_ns + kMs));
    ASSERT_EQ(force_n, device.forces.back()) << "tick " << k;
    most_n = std::max(most_n, glm::length(force_n));
  }
  EXPECT_GT(most_n, 1.0);
}

TEST(HostLoop, RunsAtFourThousandTicksASecond) {
  Bench fast, usual;
  EXPECT_LT(fast.go(8000, kMs / 4), kSteepest_n_per_ms);
  usual.go(2000);
  EXPECT_GT(glm::length(usual.force_n), 1.0);
  EXPECT_NEAR(glm::length(fast.force_n), glm::length(usual.force_n), 0.05);
}

TEST(HostLoop, TakesGarbageForAFaultAndComesBack) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  for (const glm::dvec3 garbage : {glm::dvec3(kNan, 0.0, 0.0), glm::dvec3(0.0, kInfinite, 0.0)}) {
    Bench bench;
    bench.go(2000);
    ASSERT_GT(glm::length(bench.force_n), 1.0);
    for (int k = 0; k < 200; ++k) {
      const glm::dvec3 now_n = bench.to(garbage);
      ASSERT_LE(glm::length(now_n - bench.force_n), kSteepest_n_per_ms) << "tick " << k;
      bench.force_n = now_n;
    }
    EXPECT_EQ(bench.force_n, glm::dvec3(0.0));
    EXPECT_EQ(bench.last().fault, DeviceFault::kGarbage);
    EXPECT_LT(bench.leave_and_come_back(), kSteepest_n_per_ms);
    EXPECT_GT(glm::length(bench.force_n), 1.0);
  }
}

TEST(HostLoop, TakesATimeThatDoesNotRiseForAFault) {
  Bench bench;
  bench.go(2000);
  ASSERT_GT(glm::length(bench.force_n), 1.0);
  for (const int64_t passed_ns : {int64_t(0), -50 * kMs}) {
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3 now_n = bench.loop.tick({hand_at(bench.time_ns), bench.time_ns + passed_ns});
      EXPECT_LE(glm::length(now_n - bench.force_n), kSteepest_n_per_ms);
      bench.force_n = now_n;
      EXPECT_EQ(bench.last().fault, DeviceFault::kGarbage);
    }
  }
  EXPECT_LT(bench.leave_and_come_back(), kSteepest_n_per_ms);
  EXPECT_GT(glm::length(bench.force_n), 1.0);
}

TEST(HostLoop, RampsWhenTheHostWasAwayAndComesBack) {
  Bench bench;
  bench.go(2000);
  const glm::dvec3 before_n = bench.force_n;
  bench.force_n = bench.to(hand_at(bench.time_ns), 300 * kMs);
  EXPECT_LE(glm::length(bench.force_n - before_n), kSteepest_n_per_ms);
  EXPECT_EQ(bench.loop.statistics().late.load(), 1U);
  EXPECT_EQ(bench.last().cause, Cause::kLate);
  EXPECT_LT(bench.leave_and_come_back(), kSteepest_n_per_ms);
  EXPECT_GT(glm::length(bench.force_n), 1.0);
}

TEST(HostLoop, RampsToZeroAtAStopAndStaysThere) {
  Bench bench;
  bench.go(2000);
  ASSERT_GT(glm::length(bench.force_n), 1.0);
  bench.loop.stop();
  EXPECT_FALSE(bench.loop.at_rest());
  EXPECT_LT(bench.go(600), kSteepest_n_per_ms);
  EXPECT_EQ(bench.force_n, glm::dvec3(0.0));
  EXPECT_TRUE(bench.loop.at_rest());
  bench.go(2000);
  EXPECT_EQ(bench.force_n, glm::dvec3(0.0));
}

TEST(HostLoop, TakesTheTimeItselfWhereTheHostGivesNone) {
  Bench bench;
  const glm::dvec3 inside_m = hand_at(kStart_ns + 1000 * kMs);
  bench.loop.tick({inside_m, 0});
  SceneSnapshot snapshot, later;
  ASSERT_TRUE(bench.ticker.newest(0, snapshot));
  bench.loop.tick({inside_m, 0});
  ASSERT_TRUE(bench.ticker.newest(0, later));
  EXPECT_GT(later.now_ns, snapshot.now_ns);
}

}  // namespace
}  // namespace palpate
