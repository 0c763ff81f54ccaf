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
  static constexpr int kWithin = 3;  ///< ticks to detect a fault: three answers that are missing
  /// For machines that are busy: an answer that comes at all comes in time, and a host that is late
  /// is not away.
  static Options patient();
  explicit FalconRig(const Options& options);
  ~FalconRig() override;

  /// Out and in again with the homing light on.
  bool home();

  /// The Falcon that is used; a second one may take over.
  EmulatedFalcon falcon;
  EmulatedFalcon* used = &falcon;
  std::list<EmulatedFalcon> others;  ///< plugged in by a test; the hand moves all of them
  void find(EmulatedFalcon& again);  ///< it is plugged in, or takes commands again
  std::unique_ptr<FalconDevice> device;

 private:
  void place(glm::dvec3 grip_m) override;
};

}  // namespace palpate::devices::test
