#include "tests/devices/falcon_rig.h"

#include <stdexcept>

#include "integration/devices/falcon_kinematics.h"

namespace palpate::devices::test {

FalconRig::Options FalconRig::patient() {
  Options options;
  options.falcon.answer_wait_ns = 50'000'000;
  options.falcon.away_ns = 5'000'000'000;
  return options;
}

FalconRig::FalconRig(const Options& options) : falcon(options.emulated) {
  hold(falcon, falcon::kWorkspaceCentre);
  falcon.plug();
  auto made = FalconDevice::make(options.falcon);
  if (!made) throw std::runtime_error(made.error().message);
  device = std::move(*made);
  start(*device);
}

FalconRig::~FalconRig() = default;

bool FalconRig::home() {
  holds_grip = false;
  for (const int counts : {1000, -1000}) {
    used->set_counts({counts, counts, counts});
    run_periods(5);
  }
  const auto at = falcon::forward(falcon::arm_angles({-1000, -1000, -1000}), {0, 0, 0.1});
  hand_is_at(at.value().metres);
  holds_grip = true;
  return true;
}

void FalconRig::find(EmulatedFalcon& again) {
  used = &again;
  DeviceRig::find(again);
}

void FalconRig::place(glm::dvec3 grip_m) {
  falcon.place(grip_m);
  for (EmulatedFalcon& other : others) other.place(grip_m);
}

}  // namespace palpate::devices::test
