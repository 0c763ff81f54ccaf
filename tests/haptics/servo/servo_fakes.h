#pragma once

#include <algorithm>
#include <atomic>
#include <functional>
#include <vector>

#include "module/haptics/device.h"
#include "module/haptics/servo/servo_clock.h"
#include "module/haptics/ticker.h"

namespace palpate::test {

/// A clock that advances only when a test sets it, or when the loop sleeps on it.
class FakeClock : public ServoClock {
 public:
  int64_t now_ns() noexcept override { return now; }
  void sleep_until(int64_t time_ns) noexcept override {
    now = std::max(now, time_ns + oversleep_ns);
    oversleep_ns = 0;
  }
  int64_t now = 5'000'000'000;
  int64_t oversleep_ns = 0;  ///< the next sleep is longer by this
};

/// A device that stores every force that it gets and takes a given time to answer.
class FakeDevice : public ForceDevice {
 public:
  explicit FakeDevice(FakeClock& clock) : clock_(clock) {}
  DeviceInfo info() const override { return {}; }
  DeviceReading exchange(const DeviceCommand& command) noexcept override {
    forces.push_back(command.force_n);
    times_ns.push_back(clock_.now);
    DeviceReading reading;
    reading.time_ns = clock_.now;
    reading.position_m = glm::dvec3(double(forces.size()), 0.0, 0.0);
    reading.fresh = true;
    clock_.now += takes_ns;
    if (answer) answer(reading);
    return reading;
  }
  int64_t takes_ns = 1'000;
  std::function<void(DeviceReading&)> answer;
  std::vector<glm::dvec3> forces;
  std::vector<int64_t> times_ns;

 private:
  FakeClock& clock_;
};

/// A tick that gives the force that the test sets, and brings it to zero in 20 equal steps after a
/// request to stop.
class FakeTicker : public Ticker {
 public:
  TickOutput tick(const TickInput& input) noexcept override {
    inputs.push_back(input);
    if (on_tick) on_tick(input);
    if (input.stop && obeys_stop) steps_left = std::max(0, steps_left - 1);
    TickOutput output;
    output.command.force_n = force_n * (double(steps_left) / 20.0);
    output.probe_m = input.reading.position_m;
    return output;
  }
  glm::dvec3 force_n{0.0, 2.0, 0.0};
  bool obeys_stop = true;
  int steps_left = 20;
  std::function<void(const TickInput&)> on_tick;
  std::vector<TickInput> inputs;
};

}  // namespace palpate::test
