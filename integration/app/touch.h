#pragma once

#include <optional>

#include "integration/app/felt_scene.h"
#include "integration/devices/made_paths.h"
#include "module/haptics/device.h"

namespace palpate::app {

/// Where a simulated hand can press a surface of the scene: the first place at which a surface mode
/// comes to half its strength when one goes from the edge of the device's reach towards its centre,
/// from the front, from above, from the sides, and so on. In its first frame. None if there is no
/// such place with room before it.
std::optional<devices::PathPlace> place_to_touch(const FeltScene& scene, const DeviceInfo& device);

}  // namespace palpate::app
