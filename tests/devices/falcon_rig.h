#pragma once

#include <list>
#include <memory>

#include "integration/devices/falcon.h"
#include "tests/devices/emulated_falcon.h"
#include "tests/devices/fault_rig.h"

namespace palpate::devices::test {

/// A FalconDevice on the emulated bus.
class FalconRig final : public DeviceRig {
 public:
  struct Options {
    FalconOptions falcon;
    EmulatedFalcon::Options emulated;
  };
  /// Ticks to detect a fault: three missing answers.
  static constexpr int kWithin = 3;
  /// For busy machines: every answer that arrives is in time, and a late host does not count as
  /// away.
  static Options patient();
  explicit FalconRig(const Options& options);
  ~FalconRig() override;

  /// Moves out and in again while the homing light is on.
  bool home();

  /// The Falcon that is used; a second one may replace it.
  EmulatedFalcon falcon;
  EmulatedFalcon* used = &falcon;
  /// Plugged in by a test; the hand moves all of them.
  std::list<EmulatedFalcon> others;
  /// It is plugged in, or accepts commands again.
  void find(EmulatedFalcon& again);
  std::unique_ptr<FalconDevice> device;

 private:
  void place(glm::dvec3 grip_m) override;
};

}  // namespace palpate::devices::test
