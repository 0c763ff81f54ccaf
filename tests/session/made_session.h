#pragma once

#include <memory>
#include <utility>

#include "module/haptics/device.h"
#include "module/scene/moving_volume.h"

namespace palpate::test {

/// What a host reports about its force device.
inline DeviceInfo host_device() {
  DeviceInfo info;
  info.kind = "test";
  info.max_force_n = 10.0;
  info.workspace_radius_m = 1.0;
  return info;
}

/// A volume of one frame.
inline std::shared_ptr<const MovingVolume> still(std::shared_ptr<const FrameData> frame) {
  MovingVolume volume;
  volume.times = {{0.0}, 0.0};
  volume.frames = {std::move(frame)};
  return std::make_shared<const MovingVolume>(std::move(volume));
}

}  // namespace palpate::test
