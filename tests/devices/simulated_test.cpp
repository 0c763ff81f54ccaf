#include "integration/devices/simulated.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "integration/devices/simulated_paths.h"

namespace palpate::devices {
namespace {

/// A spring wall below y = 0.
DeviceCommand wall(const DeviceReading& reading, double stiffness_n_per_m) {
  DeviceCommand command;
  command.force_n.y = std::max(0.0, -stiffness_n_per_m * reading.position_m.y);
  return command;
}

SimulatedOptions pressing() {
  SimulatedOptions options;
  options.path = press_path({.times = 3});
  return options;
}

/// A device that is at rest unless the motors move it: no hand, no friction.
SimulatedOptions bare() {
  SimulatedOptions options;
  options.body = {.mass_kg = 0.1, .damping_n_s_per_m = 0.0};
  options.resolution_m = 0.0;
  return options;
}

DeviceCommand force_x(double force_n) {
  return {.force_n = {force_n, 0, 0}};
}

TEST(SimulatedDevice, PushesBackWithTheForceOfTheWall) {
  SimulatedDevice device(pressing());
  DeviceReading reading;
  for (int n = 0; n < 2200; ++n) {
    reading = device.exchange(wall(reading, 500.0));
    device.step(1e-3);
  }
  // The hand aims 10 mm inside. Its own spring of 135 N/m and the wall's 500 N/m are in balance,
  // but for dry friction (0.03 N) and half a count.
  const double depth = -device.true_position_m().y;
  EXPECT_NEAR(depth, 0.01 * 135.0 / 635.0, 0.03 / 635.0 + 19e-6 * 500.0 / 635.0 + 1e-9);
  EXPECT_EQ(reading.fault, DeviceFault::kNone);
  EXPECT_TRUE(reading.fresh);
}

TEST(SimulatedDevice, GivesTheSameBitsForTheSameSeedAndTimes) {
  SimulatedOptions options = pressing();
  options.jitter_s = 0.3e-3;
  options.read_delay_s = 0.7e-3;
  options.force_delay_s = 0.45e-3;
  options.lost_share = 0.02;
  SimulatedDevice stepped(options), timed(options);
  options.seed = 2;
  SimulatedDevice other(options);
  DeviceReading a, b, c;
  bool differs = false;
  for (int n = 0; n < 3000; ++n) {
    a = stepped.exchange(wall(a, 800.0));
    b = timed.exchange_at(wall(b, 800.0), int64_t(n) * 1'000'000);
    c = other.exchange(wall(c, 800.0));
    stepped.step(1e-3);
    other.step(1e-3);
    ASSERT_EQ(a.position_m, b.position_m) << "tick " << n;
    ASSERT_EQ(a.time_ns, b.time_ns);
    ASSERT_EQ(a.fresh, b.fresh);
    differs = differs || a.position_m != c.position_m;
  }
  EXPECT_TRUE(differs);
}

TEST(SimulatedDevice, RunsWithTheClockAsItRunsStepped) {
  // The clock sets the times of the exchanges; repeated at the same times, the bits are the same.
  SimulatedOptions options = pressing();
  options.real_time = true;
  SimulatedDevice live(options);
  const int64_t start_ns = live.now_ns();
  options.real_time = false;
  SimulatedDevice again(options);
  DeviceReading a, b;
  for (int n = 0; n < 50; ++n) {
    const DeviceCommand command = wall(a, 800.0);
    a = live.exchange(command);
    b = again.exchange_at(command, live.now_ns() - start_ns);
    ASSERT_EQ(a.position_m, b.position_m) << "tick " << n;
    ASSERT_EQ(a.time_ns - start_ns, b.time_ns);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(live.true_position_m(), again.true_position_m());
}

TEST(SimulatedDevice, IsConvergedAtItsUsualSubStep) {
  // Contact with dry friction, fractional delays and a slew limit, without the encoder, which would
  // change any difference into a count.
  const auto path_of = [](double sub_step_s) {
    SimulatedOptions options = pressing();
    options.sub_step_s = sub_step_s;
    options.resolution_m = 0.0;
    options.read_delay_s = 0.33e-3;
    options.force_delay_s = 0.21e-3;
    options.max_slew_n_per_s = 2000.0;
    SimulatedDevice device(options);
    std::vector<double> heights;
    DeviceReading reading;
    for (int n = 0; n < 4000; ++n) {
      reading = device.exchange(wall(reading, 1000.0));
      device.step(1e-3);
      heights.push_back(device.true_position_m().y);
    }
    return heights;
  };
  const auto usual = path_of(50e-6), half = path_of(25e-6);
  double largest = 0.0;
  for (size_t n = 0; n < usual.size(); ++n)
    largest = std::max(largest, std::abs(usual[n] - half[n]));
  EXPECT_LT(largest, 1e-9);  // measured 2e-10, falling with the step; an encoder count is 38e-6
}

TEST(SimulatedDevice, RoundsPositionsToTheEncoder) {
  SimulatedOptions options = pressing();
  options.resolution_m = 60e-6;
  SimulatedDevice device(options);
  for (int n = 0; n < 1500; ++n) {
    const DeviceReading reading = device.exchange({});
    const double counts = reading.position_m.y / 60e-6;
    ASSERT_NEAR(counts, std::round(counts), 1e-9);
    ASSERT_LE(std::abs(reading.position_m.y - device.true_position_m().y), 30e-6 * (1 + 1e-9));
    device.step(1e-3);
  }
}

TEST(SimulatedDevice, GivesPositionsAsOldAsItsDelay) {
  SimulatedOptions options = bare();
  options.read_delay_s = 2.3e-3;
  SimulatedDevice device(options);
  for (int n = 0; n < 50; ++n) {
    const DeviceReading reading = device.exchange(force_x(1.0));
    // Starts at once with 10 m/s^2; before the start it was at rest.
    const double then_s = std::max(0.0, n * 1e-3 - 2.3e-3);
    ASSERT_NEAR(reading.position_m.x, 5.0 * then_s * then_s, 1e-12) << n;
    ASSERT_EQ(reading.time_ns, int64_t(n) * 1'000'000 - 2'300'000);
    device.step(1e-3);
  }
}

TEST(SimulatedDevice, LetsForcesActAfterTheirDelay) {
  SimulatedOptions options = bare();
  options.force_delay_s = 1.7e-3;
  SimulatedDevice device(options);
  for (int n = 0; n < 30; ++n) {
    device.exchange(force_x(n < 10 ? 1.0 : 0.0));
    device.step(1e-3);
    // The force of 1 N acts from 1.7 ms to 11.7 ms: 10 m/s^2, then a constant speed.
    const double t = (n + 1) * 1e-3, on = std::clamp(t - 1.7e-3, 0.0, 10e-3);
    const double after = std::max(0.0, t - 11.7e-3);
    ASSERT_NEAR(device.true_position_m().x, 5.0 * on * on + 0.1 * after, 1e-12) << n;
  }
}

TEST(SimulatedDevice, TakesPositionsAtUnknownTimesWithinTheJitter) {
  SimulatedOptions options = bare();
  options.jitter_s = 0.5e-3;
  SimulatedDevice device(options);
  for (int n = 0; n < 10; ++n) device.step(1e-3);
  double least = 1.0, most = 0.0;
  for (int n = 0; n < 400; ++n) {
    device.exchange(force_x(n == 0 ? 1.0 : 0.0));  // 10 mm/s after the first millisecond
    device.step(1e-3);
    const double age_s =
        (device.true_position_m().x - device.exchange(force_x(0.0)).position_m.x) / 0.01;
    if (n < 2) continue;
    least = std::min(least, age_s);
    most = std::max(most, age_s);
  }
  EXPECT_GE(least, -1e-9);
  EXPECT_LE(most, 0.5e-3 + 1e-9);
  // In 400 draws, missed with a probability of 0.9^400.
  EXPECT_LT(least, 0.05e-3);
  EXPECT_GT(most, 0.45e-3);
}

TEST(SimulatedDevice, LosesAsManyExchangesAsAskedFor) {
  SimulatedOptions options = pressing();
  options.lost_share = 0.1;
  SimulatedDevice device(options);
  int lost = 0;
  DeviceReading before = device.exchange({});
  for (int n = 0; n < 5000; ++n) {
    device.step(1e-3);
    const DeviceReading reading = device.exchange({});
    if (!reading.fresh) {
      ++lost;
      EXPECT_EQ(reading.position_m, before.position_m);
      EXPECT_EQ(reading.time_ns, before.time_ns);
    }
    before = reading;
  }
  EXPECT_NEAR(lost, 500, 5 * std::sqrt(5000 * 0.1 * 0.9));  // five standard deviations
}

TEST(SimulatedDevice, ClampsForcesKeepingTheirDirection) {
  SimulatedOptions options = bare();
  options.max_force_n = 5.0;
  SimulatedDevice device(options);
  device.exchange({.force_n = {30.0, 40.0, 0.0}});
  device.step(1e-3);
  EXPECT_NEAR(glm::distance(device.motor_force_n(), glm::dvec3(3, 4, 0)), 0.0, 1e-12);
  device.exchange({.force_n = {std::nan(""), 0.0, 0.0}});
  device.step(1e-3);
  EXPECT_EQ(device.motor_force_n(), glm::dvec3(0.0));
}

TEST(SimulatedDevice, ChangesItsForceNoFasterThanItsMotorsCan) {
  SimulatedOptions options = bare();
  options.max_slew_n_per_s = 500.0;
  SimulatedDevice device(options);
  device.exchange(force_x(2.0));
  for (int n = 1; n <= 6; ++n) {
    device.step(1e-3);
    EXPECT_NEAR(device.motor_force_n().x, std::min(2.0, 0.5 * n), 1e-12);
  }
  // m v is the area under the ramp and under the force after it: 2*4/2 + 2*2 N ms.
  EXPECT_NEAR(device.true_velocity_m_per_s().x, 8e-3 / 0.1, 1e-12);
}

TEST(SimulatedDevice, GoesLimpWhenNoForceComes) {
  SimulatedOptions options = bare();
  options.silence_s = 0.02;
  SimulatedDevice device(options);
  device.exchange(force_x(0.1));
  device.step(0.019);
  EXPECT_EQ(device.motor_force_n().x, 0.1);
  device.step(0.002);
  EXPECT_EQ(device.motor_force_n().x, 0.0);
}

TEST(SimulatedDevice, StopsHardAtTheEndOfItsWorkspace) {
  SimulatedOptions options = bare();
  options.workspace_radius_m = 0.01;
  SimulatedDevice device(options);
  for (int n = 0; n < 200; ++n) {
    device.exchange(force_x(1.0));
    device.step(1e-3);
    ASSERT_LE(glm::length(device.true_position_m()), 0.01 * (1 + 1e-12));
  }
  EXPECT_NEAR(device.true_position_m().x, 0.01, 1e-12);
  EXPECT_NEAR(device.true_velocity_m_per_s().x, 0.0, 1e-9);
}

TEST(SimulatedDevice, IsThrownByTheWallWhenTheHandLetsGo) {
  SimulatedOptions options = pressing();
  options.lets_go_at_s = 2.0;
  SimulatedDevice device(options);
  DeviceReading reading;
  double held_m = 0.0;
  for (int n = 0; n < 2600; ++n) {
    if (n == 2000) held_m = device.true_position_m().y;
    reading = device.exchange(wall(reading, 500.0));
    device.step(1e-3);
  }
  EXPECT_LT(held_m, -1e-3);
  EXPECT_GT(device.true_position_m().y, 0.0);
}

TEST(SimulatedDevice, BooksTheWorkOfItsMotors) {
  SimulatedDevice device(bare());
  for (int n = 0; n < 100; ++n) {
    device.exchange(force_x(0.01 * n));
    device.step(1e-3);
  }
  const double speed = device.true_velocity_m_per_s().x;
  // There are no losses.
  EXPECT_NEAR(device.motor_work_j(), 0.5 * 0.1 * speed * speed, 1e-12);
}

TEST(SimulatedDevice, DoesNotMakeUpForALongStopOfTheProgram) {
  SimulatedOptions options = pressing();
  SimulatedDevice device(options);
  device.exchange(force_x(1.0));
  const DeviceReading reading = device.exchange_at({}, 3600'000'000'000);
  EXPECT_EQ(reading.time_ns, 3600'000'000'000);
  EXPECT_TRUE(std::isfinite(reading.position_m.x));
  EXPECT_EQ(device.motor_force_n(), glm::dvec3(0.0));
}

TEST(SimulatedDevice, GivesTheButtonsOfItsPath) {
  SimulatedOptions options;
  options.path = ScriptedPath({{0.0, {}, 0}, {0.5, {}, 5}, {1.0, {}, 0}});
  SimulatedDevice device(options);
  EXPECT_EQ(device.exchange({}).buttons, 0u);
  device.step(0.6);
  EXPECT_EQ(device.exchange({}).buttons, 5u);
  EXPECT_EQ(device.info().buttons, 4);
}

}  // namespace
}  // namespace palpate::devices
