#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "compute/volume/result.h"
#include "module/haptics/device.h"
#include "module/haptics/guard/safety.h"
#include "module/scene/scene_spec.h"

namespace palpate::loading {

/// What a recording contains besides its ticks: the scene, the properties of the device that the
/// loop depends on, and the guards' options that the command line can change.
struct ReplayKey {
  SceneSpec scene;
  DeviceInfo device;
  SafetyOptions safety;
  uint32_t tube_buttons = 0;  ///< that release stream tubes
};

/// The key as JSON text.
std::string text_of(const ReplayKey& key);

/// Parses the key of the recording `file`. Every number in it is finite; limits and times are not
/// negative. `more_kinds`: kinds of mode beside the built-in ones. Errors: kBadInput, with the name
/// of the file, for any other text.
Result<ReplayKey> parse_replay_key(const std::filesystem::path& file, std::string_view text,
                                   const std::vector<std::string>& more_kinds = {});

}  // namespace palpate::loading
