#pragma once

#include <array>
#include <atomic>
#include <mutex>
#include <vector>

namespace palpate::devices::test {

/// What the made library (fake_dhd.cpp) is told to do and what it was told. Position and forces in
/// the library's axes: x towards the user, y right, z up. It lives in the library, which a test
/// opens beside the code under test: fake_dhd() gives it.
struct FakeDhd {
  std::mutex mutex;  ///< guards `forces`
  std::vector<std::array<double, 3>> forces;

  std::atomic<int> devices = 1, type = 33;
  std::atomic<double> x = 0.0, y = 0.0, z = 0.0;
  std::array<std::atomic<int>, 17> status{};  ///< as dhdGetStatus gives it
  std::atomic<unsigned> buttons = 0;

  // What goes wrong. Each stays until it is changed.
  std::atomic<int> position_returns = 0, force_returns = 0;  ///< -1: an error; 1, 2: its remarks
  std::atomic<int> open_returns = 0, status_returns = 0;
  std::atomic<int> error = 0;                  ///< dhdErrorGetLast
  std::atomic<int> position_skips = 0;         ///< so many calls say that the time guard is up
  std::atomic<bool> hangs = false;             ///< dhdSetForce does not come back
  std::atomic<bool> brakes_by_itself = false;  ///< force off, for its speed

  std::atomic<int> opened = 0, closed = 0, force_enabled = 0;
  std::atomic<double> max_force = 0.0;
  std::atomic<int> gravity = 0;
};

}  // namespace palpate::devices::test

extern "C" palpate::devices::test::FakeDhd* fake_dhd();
