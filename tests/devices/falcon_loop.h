#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <thread>

#include "integration/devices/falcon.h"
#include "module/haptics/device.h"
#include "tests/devices/emulated_falcon.h"
#include "tests/devices/print_fault.h"
#include "tests/support/wait_for.h"

namespace palpate::devices::test {

/// Times for busy machines: every answer that arrives is in time.
inline FalconOptions patient(FalconOptions options = {}) {
  options.answer_wait_ns = 50'000'000;
  options.away_ns = 5'000'000'000;
  return options;
}

inline std::unique_ptr<FalconDevice> opened(const FalconOptions& options) {
  auto device = FalconDevice::make(options);
  if (!device) {
    ADD_FAILURE() << device.error().message;
    return nullptr;
  }
  return std::move(*device);
}

/// A small servo loop with a constant force, which a ramp lets in. After a fault it goes on
/// commanding a force for a while, as a ramp down does; the device must suppress it. Every step
/// checks the guarantees for the commands that the emulated device receives.
class FalconLoop {
 public:
  FalconLoop(FalconDevice& device, EmulatedFalcon& falcon) : device_(device), falcon_(falcon) {}

  glm::dvec3 wanted_n{0.5, -0.3, 2.0};
  bool in_contact = true;
  /// The OUT endpoint accepts commands, so what is received can be checked.
  bool reachable = true;
  std::function<void()> each;  ///< called before every exchange

  DeviceReading step() {
    if (each) each();
    const bool trusted = last.fault == DeviceFault::kNone && steps > 0;
    const size_t before = falcon_.received_count();
    share_ = trusted ? std::min(1.0, share_ + 0.05) : std::max(0.0, share_ - 0.05);
    last = device_.exchange({share_ * wanted_n, in_contact});
    ++steps;
    if (!reachable) return last;
    if (last.fault != DeviceFault::kNone) {
      EXPECT_FALSE(falcon_.last().pushes())
          << "a force is left in the device after an exchange with the fault "
          << sentence(last.fault);
    }
    if (!trusted) {
      const auto received = falcon_.received();
      for (size_t n = before; n < received.size(); ++n)
        EXPECT_FALSE(received[n].pushes()) << "a force before the device was reported to work";
    }
    return last;
  }

  /// Steps until `holds` is true; a failure after kPatience.
  bool until(const std::function<bool()>& holds, const char* what) {
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (!holds()) {
      if (std::chrono::steady_clock::now() > end) {
        ADD_FAILURE() << "waited in vain: " << what << "; last: " << sentence(last.fault);
        return false;
      }
      step();
      // Without a device the loop would only use the processor time that the worker needs.
      if (last.fault != DeviceFault::kNone && !last.fresh)
        std::this_thread::sleep_for(std::chrono::microseconds(300));
    }
    return true;
  }
  bool until_fault(DeviceFault fault) {
    return until([&] { return steps > 0 && last.fault == fault; }, sentence(fault));
  }
  /// Until the full force acts.
  bool until_pushing() {
    return until(
        [&] {
          return last.fault == DeviceFault::kNone && share_ >= 1.0 && falcon_.last().pushes();
        },
        "the force");
  }
  void run(int count) {
    for (int n = 0; n < count; ++n) step();
  }

  DeviceReading last;
  int steps = 0;

 private:
  FalconDevice& device_;
  EmulatedFalcon& falcon_;
  double share_ = 0.0;
};

}  // namespace palpate::devices::test
