#pragma once

#include <optional>

#include "integration/devices/simulated_paths.h"
#include "integration/loading/load_scene.h"
#include "module/haptics/device.h"

namespace palpate::running {

/// A place where a simulated hand can press a surface of the scene's first frame: the first place
/// at which a surface mode reaches half its strength, or a segment begins. It is looked for on the
/// way from the edge of the device's reach to its centre, from the front, from above, from the
/// sides, and so on. A place around which the wall holds a hand that moves 3 mm aside comes before
/// others. If the data are cut off inside the body on all sides: the wall of the widest free space
/// within reach (a lung, for example). Empty if there is no such place.
std::optional<devices::PathPlace> place_to_touch(const LoadedScene& scene,
                                                 const DeviceInfo& device);

}  // namespace palpate::running
