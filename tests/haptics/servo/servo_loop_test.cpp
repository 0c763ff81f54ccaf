// The servo loop step by step, with a clock, a device and a tick that the test controls. The oracle
// is arithmetic on the fake clock's nanoseconds.
#include "module/haptics/servo/servo_loop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/haptics/servo/servo_fakes.h"

namespace palpate {
namespace {

using test::FakeClock, test::FakeDevice, test::FakeTicker;

constexpr int64_t kMs_ns = 1'000'000;

struct LoopBench {
  explicit LoopBench(LoopOptions wanted = {}) : options(wanted) {}
  void run_periods(int n) {
    for (int k = 0; k < n; ++k) loop.run_period();
  }
  uint64_t misses(MissCause cause) { return ports.statistics.misses[int(cause)].load(); }
  LoopOptions options;
  FakeClock clock;
  FakeDevice device{clock};
  FakeTicker ticker;
  ServoPorts ports;
  ServoLoop loop{device, ticker, clock, ports, options};
};

LoopOptions with(Exchanges exchanges) {
  LoopOptions options;
  options.exchanges = exchanges;
  return options;
}

TEST(ServoLoop, TicksOncePerPeriodOnAbsoluteDeadlines) {
  LoopBench bench(with(Exchanges::kOnce));
  const int64_t start = bench.clock.now;
  // The time of the exchange must not lengthen the period.
  bench.device.takes_ns = 300'000;
  bench.run_periods(1000);
  ASSERT_EQ(bench.device.times_ns.size(), 1000u);
  for (int k = 0; k < 1000; ++k) {
    ASSERT_EQ(bench.device.times_ns[k], start + (k + 1) * kMs_ns) << k;
  }
  EXPECT_EQ(bench.ports.statistics.all_misses(), 0u);
  EXPECT_EQ(bench.ports.statistics.period.most_ns(), kMs_ns);
  EXPECT_EQ(bench.ports.statistics.ticks.load(), 1000u);
  for (const TickInput& input : bench.ticker.inputs) ASSERT_DOUBLE_EQ(input.dt_s, 1e-3);
}

TEST(ServoLoop, SendsAForceOneRoundTripAfterItsPositionWhenItExchangesTwice) {
  LoopBench bench(with(Exchanges::kTwice));
  bench.device.takes_ns = 200'000;
  bench.run_periods(10);
  ASSERT_EQ(bench.device.times_ns.size(), 20u);
  for (int k = 0; k < 10; ++k)
    EXPECT_EQ(bench.device.times_ns[2 * k + 1] - bench.device.times_ns[2 * k], 200'000) << k;
  // The first exchange of a period repeats the present force; the second sends the new one.
  EXPECT_EQ(bench.device.forces[0], glm::dvec3(0.0));
  for (int k = 1; k < 20; ++k) EXPECT_EQ(bench.device.forces[k], bench.ticker.force_n) << k;
}

TEST(ServoLoop, ChoosesTwoExchangesForAFastDeviceAndOneForASlowOne) {
  LoopBench fast;
  fast.device.takes_ns = 390'000;
  fast.run_periods(64);
  // The 64th answer decides, also for its own period.
  EXPECT_EQ(fast.device.forces.size(), 65u);
  fast.run_periods(10);
  EXPECT_EQ(fast.device.forces.size(), 65u + 20u);
  EXPECT_TRUE(fast.ports.statistics.twice.load());

  LoopBench slow;
  slow.device.takes_ns = 410'000;
  slow.run_periods(200);
  EXPECT_EQ(slow.device.forces.size(), 200u);
}

TEST(ServoLoop, FindsItsExchangesAnewAfterAFault) {
  LoopBench bench;
  bench.run_periods(100);
  ASSERT_TRUE(bench.ports.statistics.twice.load());
  bench.device.answer = [](DeviceReading& reading) { reading.fault = DeviceFault::kTimeout; };
  bench.run_periods(1);
  EXPECT_FALSE(bench.ports.statistics.twice.load());
  bench.device.answer = nullptr;
  bench.device.takes_ns = 600'000;
  bench.run_periods(100);
  EXPECT_FALSE(bench.ports.statistics.twice.load());
}

TEST(ServoLoop, KeepsAFaultAndAPositionThatOnlyTheSecondAnswerBrought) {
  LoopBench bench(with(Exchanges::kTwice));
  int answers = 0;
  bench.device.answer = [&](DeviceReading& reading) {
    ++answers;
    if (answers == 2) reading.fault = DeviceFault::kJumped;
    if (answers == 3) reading.fresh = false;
    reading.grip.opens = true;
    reading.grip.opening_rad = answers;
  };
  bench.run_periods(3);
  EXPECT_EQ(bench.ticker.inputs[1].reading.fault, DeviceFault::kJumped);
  EXPECT_TRUE(bench.ticker.inputs[1].reading.fresh);
  EXPECT_EQ(bench.ticker.inputs[1].reading.position_m.x, 2.0);  // the second answer's
  EXPECT_EQ(bench.ticker.inputs[1].reading.grip.opening_rad, 2.0);
  EXPECT_EQ(bench.ticker.inputs[2].reading.fault, DeviceFault::kNone);
  EXPECT_EQ(bench.ticker.inputs[2].reading.position_m.x, 5.0);
}

TEST(ServoLoop, CountsALateWakeUpAndDoesNotCatchUp) {
  LoopBench bench(with(Exchanges::kOnce));
  bench.run_periods(10);
  bench.clock.oversleep_ns = 50 * kMs_ns;
  bench.run_periods(10);
  EXPECT_EQ(bench.misses(MissCause::kWokeLate), 1u);
  EXPECT_EQ(bench.ports.statistics.all_misses(), 1u);
  EXPECT_DOUBLE_EQ(bench.ticker.inputs[10].dt_s, 51e-3);
  EXPECT_TRUE(bench.ticker.inputs[10].late);
  for (size_t k = 11; k < 20; ++k) {
    EXPECT_DOUBLE_EQ(bench.ticker.inputs[k].dt_s, 1e-3) << k;
    EXPECT_FALSE(bench.ticker.inputs[k].late) << k;
  }
  EXPECT_EQ(bench.ports.statistics.late.load(), 1u);
}

TEST(ServoLoop, CallsATickLateOnlyBeyondTheWatchdog) {
  LoopBench bench(with(Exchanges::kOnce));
  bench.run_periods(2);
  bench.clock.oversleep_ns = 4 * kMs_ns;  // 5 ms apart: at the limit
  bench.run_periods(1);
  EXPECT_FALSE(bench.ticker.inputs.back().late);
  bench.clock.oversleep_ns = 4 * kMs_ns + 1;
  bench.run_periods(1);
  EXPECT_TRUE(bench.ticker.inputs.back().late);
}

TEST(ServoLoop, BlamesALongTickOrALongAnswerForTheMissThatFollows) {
  LoopBench bench(with(Exchanges::kOnce));
  bench.run_periods(3);
  bench.ticker.on_tick = [&](const TickInput&) { bench.clock.now += 3 * kMs_ns; };
  bench.run_periods(1);
  bench.ticker.on_tick = nullptr;
  // The next period is the one that begins too late.
  EXPECT_EQ(bench.ports.statistics.all_misses(), 0u);
  bench.run_periods(3);
  EXPECT_EQ(bench.misses(MissCause::kTickLong), 1u);

  bench.device.takes_ns = 5 * kMs_ns;
  bench.run_periods(1);
  bench.device.takes_ns = 1'000;
  bench.run_periods(3);
  EXPECT_EQ(bench.misses(MissCause::kDeviceLong), 1u);
  EXPECT_EQ(bench.ports.statistics.all_misses(), 2u);
}

TEST(ServoLoop, RunsBackToBackWithADeviceThatNeedsMoreThanThePeriod) {
  LoopBench bench(with(Exchanges::kOnce));
  bench.device.takes_ns = 1'300'000;
  const int64_t start = bench.clock.now;
  bench.run_periods(100);
  // One period of waiting at the start, then only the exchanges.
  EXPECT_EQ(bench.clock.now - start, kMs_ns + 100 * 1'300'000);
}

TEST(ServoLoop, SurvivesAClockThatGoesBackByAnHour) {
  LoopBench bench(with(Exchanges::kOnce));
  bench.run_periods(5);
  bench.ticker.on_tick = [&](const TickInput&) { bench.clock.now -= 3'600'000 * kMs_ns; };
  bench.run_periods(1);
  bench.ticker.on_tick = nullptr;
  const int64_t jumped_to = bench.clock.now;
  bench.run_periods(5);
  EXPECT_LE(bench.clock.now, jumped_to + 6 * kMs_ns);  // it did not sleep for the hour
  EXPECT_EQ(bench.misses(MissCause::kClock), 1u);
  // The negative interval is passed on; the tick handles it.
  EXPECT_LT(bench.ticker.inputs[6].dt_s, 0.0);
  EXPECT_DOUBLE_EQ(bench.ticker.inputs[7].dt_s, 1e-3);
}

TEST(ServoLoop, PassesAStandingClockOn) {
  LoopBench bench(with(Exchanges::kOnce));
  class Standing : public FakeClock {
    void sleep_until(int64_t) noexcept override {}
  } clock;
  FakeDevice device(clock);
  device.takes_ns = 0;
  ServoLoop loop(device, bench.ticker, clock, bench.ports, bench.options);
  for (int k = 0; k < 10; ++k) loop.run_period();
  for (size_t k = 1; k < 10; ++k) EXPECT_EQ(bench.ticker.inputs[k].dt_s, 0.0) << k;
}

TEST(ServoLoop, BringsEventsAndPosesInOrderFourAtATime) {
  LoopBench bench;
  for (int k = 0; k < 10; ++k)
    ASSERT_TRUE(bench.ports.events.push({ControlEvent::Kind::kModeGain, k, 0.5}));
  for (int k = 0; k < 3; ++k) ASSERT_TRUE(bench.ports.poses.push({.volume = k}));
  bench.run_periods(4);
  std::vector<int> seen;
  for (const TickInput& input : bench.ticker.inputs)
    for (int k = 0; k < input.event_count; ++k) seen.push_back(input.events[k].index);
  EXPECT_THAT(seen, testing::ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9));
  EXPECT_EQ(bench.ticker.inputs[0].event_count, 4);
  EXPECT_EQ(bench.ticker.inputs[2].event_count, 2);
  EXPECT_EQ(bench.ticker.inputs[0].pose_count, 3);
  EXPECT_EQ(bench.ticker.inputs[1].pose_count, 0);
}

TEST(ServoLoop, GivesTheNewestTickToBothReaders) {
  LoopBench bench;
  TickOutput output;
  EXPECT_FALSE(bench.ports.outputs[0].get(output));
  bench.run_periods(3);
  for (auto& reader : bench.ports.outputs) {
    EXPECT_TRUE(reader.get(output));
    EXPECT_EQ(output.probe_m.x, 3.0);
    EXPECT_FALSE(reader.get(output));
    EXPECT_EQ(output.probe_m.x, 3.0);
  }
}

TEST(ServoLoop, StopsOnceTheDeviceHadZeroThreeTimes) {
  for (Exchanges exchanges : {Exchanges::kOnce, Exchanges::kTwice}) {
    LoopBench bench(with(exchanges));
    bench.run_periods(50);
    bench.ports.stop = true;
    int periods = 0;
    while (bench.loop.run_period()) ASSERT_LT(++periods, 100);
    const auto& forces = bench.device.forces;
    for (size_t k = forces.size() - 3; k < forces.size(); ++k)
      EXPECT_EQ(forces[k], glm::dvec3(0.0));
    EXPECT_TRUE(bench.ports.at_rest.load());
    EXPECT_GE(periods, 19);
    // The tick's ramp has 20 equal steps: none was skipped.
    for (size_t k = 1; k < forces.size(); ++k)
      ASSERT_LE(forces[k - 1].y - forces[k].y, 2.0 / 20.0 + 1e-12) << k;
  }
}

TEST(ServoLoop, RampsByItselfWhenTheTickDoesNotObeyTheStop) {
  LoopBench bench(with(Exchanges::kOnce));
  bench.ticker.obeys_stop = false;
  bench.run_periods(10);
  bench.ports.stop = true;
  int periods = 0;
  while (bench.loop.run_period()) ASSERT_LT(++periods, 1000);
  // 500 ms for the tick, 20 ms of the loop's ramp, and three zero forces.
  EXPECT_NEAR(periods, 525, 3);
  const auto& forces = bench.device.forces;
  EXPECT_EQ(forces.back(), glm::dvec3(0.0));
  for (size_t k = 2; k < forces.size(); ++k)
    ASSERT_LE(forces[k - 1].y - forces[k].y, 2.0 / 20.0 + 1e-9) << k;
}

TEST(ServoLoop, EndsWhenTheDeviceIsSlowAndTheTickDoesNotObey) {
  LoopBench bench(with(Exchanges::kOnce));
  bench.ticker.obeys_stop = false;
  bench.device.takes_ns = 100 * kMs_ns;
  bench.run_periods(3);
  bench.ports.stop = true;
  int periods = 0;
  while (bench.loop.run_period()) ASSERT_LT(++periods, 20);
  EXPECT_EQ(bench.device.forces.back(), glm::dvec3(0.0));
}

TEST(ServoLoop, RampsAForceThatIsNoNumberToZeroAndBelievesTheTickAgainAtZero) {
  LoopBench bench(with(Exchanges::kOnce));
  bench.run_periods(10);
  bench.ticker.force_n.y = std::numeric_limits<double>::quiet_NaN();
  bench.run_periods(30);
  EXPECT_EQ(bench.ports.statistics.not_finite.load(), 30u);
  EXPECT_EQ(bench.device.forces.back(), glm::dvec3(0.0));
  for (size_t k = 2; k < bench.device.forces.size(); ++k) {
    ASSERT_EQ(bench.device.forces[k], bench.device.forces[k]) << k << ": not a number";
    ASSERT_LE(bench.device.forces[k - 1].y - bench.device.forces[k].y, 2.0 / 20.0 + 1e-9) << k;
  }
  bench.ticker.force_n.y = 2.0;
  bench.run_periods(5);
  EXPECT_EQ(bench.device.forces.back(), glm::dvec3(0.0)) << "no step from zero to the full force";
  bench.ticker.force_n.y = 0.0;
  bench.run_periods(2);
  bench.ticker.force_n.y = 1.0;
  bench.run_periods(2);
  EXPECT_EQ(bench.device.forces.back().y, 1.0);
}

}  // namespace
}  // namespace palpate
