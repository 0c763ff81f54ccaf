#pragma once

#include <array>
#include <atomic>
#include <mutex>
#include <string>
#include <vector>

namespace palpate::devices::test {

/// Settings and records of the simulated library (fake_hd.cpp). Positions in mm and forces in the
/// library's axes: x right, y up, z towards the user. The object is in the library, which a test
/// opens beside the code under test: fake_hd() returns it.
struct FakeHd {
  mutable std::mutex mutex;  ///< guards the four below
  /// What each frame gave the motors.
  std::vector<std::array<double, 3>> forces;
  /// Calls that its documents do not allow.
  std::vector<std::string> broken_rules;
  std::string initialised;                  ///< with this name
  std::string configuration = "Left hand";  ///< a name that it knows, beside the default

  std::atomic<double> x = 0.0, y = 0.0, z = 0.0;
  /// Of the pen's end: its x, y and z axis, one after the other.
  std::array<std::atomic<double>, 9> axes{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  std::array<std::atomic<double>, 3> spin{};  ///< rad/s
  std::atomic<int> buttons = 0;
  /// Held by its grip, and out of its inkwell.
  std::atomic<bool> safety_switch = true, inkwell_switch = true;
  std::array<std::atomic<double>, 6> temperatures{};
  std::atomic<unsigned> calibration = 0x5000;
  std::atomic<int> styles = 4;
  /// What hdUpdateCalibration() leads to.
  std::atomic<unsigned> calibration_after_update = 0x5000;
  std::atomic<int> updates = 0, updated_style = 0;
  std::atomic<double> max_force = 3.3, continuous_force = 0.88, stiffness = 0.5;
  /// Whether it knows temperatures, switches, and how its pen is held.
  std::atomic<bool> knows_temperatures = true, knows_switches = true, knows_rotation = true;
  std::atomic<int> period_us = 1000;  ///< of the scheduler

  // Faults. Each stays until it is changed.
  std::atomic<bool> is_there = true;
  std::atomic<unsigned> frame_error = 0, begin_error = 0, init_error = 0, start_error = 0,
                        schedule_error = 0;
  std::atomic<bool> loses_forces = false;  ///< frames do not reach the motors
  std::atomic<bool> stands = false;        ///< the scheduler runs no callback
  std::atomic<bool> hangs = false;         ///< hdBeginFrame() does not return
  std::atomic<int> frame_us = 0;           ///< that hdBeginFrame() takes
  /// It switches the force off by itself, once.
  std::atomic<bool> output_off = false;

  std::atomic<int> opened = 0, closed = 0;
  std::atomic<bool> force_output = false, clamping = false, runs = false;
};

}  // namespace palpate::devices::test

extern "C" palpate::devices::test::FakeHd* fake_hd();
