// The real thread with the real clock. No test here measures time: the machine may be busy.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <mutex>

#include "module/haptics/servo/servo.h"

namespace palpate {
namespace {

/// Stores the forces that it got; read after the servo thread has ended.
class KeepingDevice : public ForceDevice {
 public:
  KeepingDevice() { forces_n.reserve(1'000'000); }
  DeviceInfo info() const override { return {}; }
  DeviceReading exchange(const DeviceCommand& command) noexcept override {
    if (forces_n.size() < forces_n.capacity()) forces_n.push_back(command.force_n.y);
    DeviceReading reading;
    reading.fresh = true;
    return reading;
  }
  std::vector<double> forces_n;
};

class RampingTicker : public Ticker {
 public:
  TickOutput tick(const TickInput& input) noexcept override {
    ++ticks;
    for (int k = 0; k < input.event_count; ++k) last_event = input.events[size_t(k)].index;
    if (input.stop) share = std::max(0.0, share - 0.05);
    TickOutput output;
    output.command.force_n.y = 2.0 * share;
    output.probe_m.x = double(ticks);
    output.proxy_m.x = double(last_event);
    return output;
  }
  int ticks = 0, last_event = -1;
  double share = 1.0;
};

ServoOptions ordinary() {
  ServoOptions options;
  options.real_time = {.priority = 0, .core = -1, .lock_memory = false, .cores_awake = false};
  return options;
}

/// Waits until `holds` is true. The limit only ends the wait for a loop that hangs.
template <class Condition>
bool eventually(Condition holds) {
  for (int k = 0; k < 30'000 && !holds(); ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return holds();
}

TEST(Servo, TicksUntilItIsStoppedAndLeavesTheDeviceAtZeroByARamp) {
  KeepingDevice device;
  RampingTicker ticker;
  auto servo = Servo::start(device, ticker, ordinary());
  ASSERT_TRUE(servo) << servo.error().message;
  EXPECT_TRUE(eventually([&] { return (*servo)->statistics().ticks.load() > 100; }));
  (*servo)->stop();
  const uint64_t ticks = (*servo)->statistics().ticks.load();
  EXPECT_EQ(uint64_t(ticker.ticks), ticks);
  ASSERT_GT(device.forces_n.size(), 100u);
  EXPECT_EQ(device.forces_n.back(), 0.0);
  EXPECT_EQ(*std::max_element(device.forces_n.begin(), device.forces_n.end()), 2.0);
  for (size_t k = 1; k < device.forces_n.size(); ++k)
    ASSERT_LE(device.forces_n[k - 1] - device.forces_n[k], 0.1 + 1e-12) << k;
  (*servo)->stop();
  EXPECT_EQ((*servo)->statistics().ticks.load(), ticks) << "stopped twice is stopped once";
}

TEST(Servo, StopsInItsDestructor) {
  KeepingDevice device;
  RampingTicker ticker;
  {
    auto servo = Servo::start(device, ticker, ordinary());
    ASSERT_TRUE(servo);
    ASSERT_TRUE(eventually([&] { return (*servo)->statistics().ticks.load() > 10; }));
  }
  EXPECT_EQ(device.forces_n.back(), 0.0);
}

// Mono and Unity stop threads that run C# by these signals: a collection would wait for ever.
TEST(Servo, LeavesTheProcessItsSignalsButTakesThoseOfGarbageCollectors) {
  class AskingDevice : public KeepingDevice {
   public:
    DeviceReading exchange(const DeviceCommand& command) noexcept override {
      pthread_sigmask(SIG_SETMASK, nullptr, &blocked);
      return KeepingDevice::exchange(command);
    }
    sigset_t blocked;
  } device;
  RampingTicker ticker;
  auto servo = Servo::start(device, ticker, ordinary());
  ASSERT_TRUE(servo);
  ASSERT_TRUE(eventually([&] { return (*servo)->statistics().ticks.load() > 1; }));
  (*servo)->stop();
  for (const int process : {SIGINT, SIGTERM, SIGHUP, SIGALRM, SIGUSR1})
    EXPECT_EQ(sigismember(&device.blocked, process), 1) << process;
  for (const int thread : {SIGSEGV, SIGPWR, SIGXCPU, SIGRTMIN, SIGRTMIN + 5, SIGRTMAX})
    EXPECT_EQ(sigismember(&device.blocked, thread), 0) << thread;
}

TEST(Servo, CarriesEventsInAndTicksOut) {
  KeepingDevice device;
  RampingTicker ticker;
  auto servo = Servo::start(device, ticker, ordinary());
  ASSERT_TRUE(servo);
  ASSERT_TRUE((*servo)->send(ControlEvent{ControlEvent::Kind::kModeOn, 42, 1.0}));
  TickOutput output;
  EXPECT_TRUE(eventually([&] {
    (*servo)->newest(1, output);
    return output.proxy_m.x == 42.0;
  }));
  EXPECT_EQ((*servo)->dropped(), 0u);
}

TEST(Servo, SaysWhatItGotOfTheSystem) {
  KeepingDevice device;
  RampingTicker ticker;
  ServoOptions options;
  options.real_time.core = 100'000;  // no machine has it
  auto servo = Servo::start(device, ticker, options);
  ASSERT_TRUE(servo);
  const ServoReport& report = (*servo)->report();
  EXPECT_THAT(report.kernel, testing::HasSubstr("Linux "));
  std::vector<std::string> names;
  for (const ServoReport::Item& item : report.items) {
    names.push_back(item.what);
    EXPECT_THAT(item.sentence, testing::EndsWith(".")) << item.what;
    EXPECT_FALSE(item.what == "pinned to a core" && item.obtained);
  }
  EXPECT_THAT(names,
              testing::UnorderedElementsAre("locked memory", "cores kept awake", "pinned to a core",
                                            "timer slack", "real-time priority"));
}

TEST(Servo, RefusesOptionsThatMakeNoSense) {
  KeepingDevice device;
  RampingTicker ticker;
  const auto sentence = [&](auto change) {
    ServoOptions options = ordinary();
    change(options);
    auto servo = Servo::start(device, ticker, options);
    return servo ? std::string() : servo.error().message;
  };
  using testing::HasSubstr;
  EXPECT_THAT(sentence([](ServoOptions& o) { o.loop.period_ns = 249'999; }),
              HasSubstr("between 250 and 10000 us"));
  EXPECT_THAT(sentence([](ServoOptions& o) { o.loop.period_ns = 10'000'001; }),
              HasSubstr("between 250 and 10000 us"));
  EXPECT_THAT(sentence([](ServoOptions& o) { o.loop.watchdog_ns = 1'000'000; }),
              HasSubstr("watchdog"));
  EXPECT_THAT(sentence([](ServoOptions& o) { o.loop.ramp_ns = 0; }), HasSubstr("ramp"));
  EXPECT_THAT(sentence([](ServoOptions& o) { o.real_time.priority = 100; }), HasSubstr("priority"));
  EXPECT_TRUE(device.forces_n.empty());
}

TEST(Servo, RunsEightAtATimeAndRefusesTheNinth) {
  std::vector<KeepingDevice> devices(9);
  std::vector<RampingTicker> tickers(9);
  std::vector<std::unique_ptr<Servo>> servos;
  for (size_t k = 0; k < 8; ++k) {
    auto servo = Servo::start(devices[k], tickers[k], ordinary());
    ASSERT_TRUE(servo) << k;
    servos.push_back(std::move(*servo));
  }
  const auto ninth = Servo::start(devices[8], tickers[8], ordinary());
  ASSERT_FALSE(ninth);
  EXPECT_THAT(ninth.error().message, testing::HasSubstr("Eight"));
  servos.pop_back();
  EXPECT_TRUE(Servo::start(devices[8], tickers[8], ordinary()));
}

TEST(Preemption, IsReadFromWhatTheKernelSays) {
  EXPECT_EQ(preemption("#1 SMP PREEMPT_RT Debian 6.1.90-1", "1"), "PREEMPT_RT");
  EXPECT_EQ(preemption("#1 SMP", "1"), "PREEMPT_RT");
  EXPECT_EQ(preemption("#1 SMP PREEMPT_DYNAMIC Debian 6.1.90-1", ""), "PREEMPT_DYNAMIC");
  EXPECT_EQ(preemption("#1 SMP PREEMPT Tue Jan 1", "0"), "PREEMPT");
  EXPECT_EQ(preemption("#30~20.04-Ubuntu SMP", ""), "voluntary");
}

}  // namespace
}  // namespace palpate
