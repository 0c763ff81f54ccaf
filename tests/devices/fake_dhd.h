#pragma once

#include <array>
#include <atomic>
#include <mutex>
#include <vector>

namespace palpate::devices::test {

/// Settings and records of the simulated library (fake_dhd.cpp). Position and forces in the
/// library's axes: x towards the user, y right, z up. The object is in the library, which a test
/// opens beside the code under test: fake_dhd() returns it.
struct FakeDhd {
  std::mutex mutex;  ///< guards the next two
  std::vector<std::array<double, 3>> forces, torques;

  std::atomic<int> devices = 1, type = 33;
  std::atomic<double> x = 0.0, y = 0.0, z = 0.0;
  /// As dhdGetStatus() returns it.
  std::array<std::atomic<int>, 17> status{};
  std::atomic<unsigned> buttons = 0;

  // Faults. Each stays until it is changed.
  std::atomic<int> position_returns = 0, force_returns = 0;  ///< -1: an error; 1, 2: its remarks
  std::atomic<int> open_returns = 0, status_returns = 0;
  std::atomic<int> error = 0;  ///< dhdErrorGetLast
  /// So many calls return that the time guard is active.
  std::atomic<int> position_skips = 0;
  /// dhdSetForce() does not return.
  std::atomic<bool> hangs = false;
  /// Force off, because of its speed.
  std::atomic<bool> brakes_by_itself = false;

  /// A wrist whose grip is turned so (rows of the matrix) and spins so, and a gripper.
  std::atomic<bool> has_wrist = false, has_active_wrist = false, has_gripper = false;
  std::array<std::atomic<double>, 9> orientation{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  std::array<std::atomic<double>, 3> spin{};
  std::atomic<double> gripper = 0.0;
  std::atomic<int> wrist_returns = 0, gripper_returns = 0;

  std::atomic<int> opened = 0, closed = 0, force_enabled = 0;
  std::atomic<double> max_force = 0.0;
  std::atomic<int> gravity = 0;
};

}  // namespace palpate::devices::test

extern "C" palpate::devices::test::FakeDhd* fake_dhd();
