#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "compute/volume/result.h"
#include "module/haptics/device.h"
#include "module/haptics/safety.h"
#include "module/scene/scene_spec.h"

namespace palpate::scenes {

/// What a recording has to know of its run besides the ticks: the scene, the part of the device
/// that the loop depends on, and what the command line may change of the guards.
struct ReplayKey {
  SceneSpec scene;
  DeviceInfo device;
  SafetyOptions safety;
  uint32_t tube_buttons = 0;  ///< with which the hand releases stream tubes
};

/// As JSON text.
std::string text_of(const ReplayKey& key);

/// The key that stands in the recording `file`. Every number in it is finite; limits and times are
/// not below zero. `more_kinds`: of mode, beside the built-in ones. Error: kBadInput, with the
/// file's name, where it is another text.
Result<ReplayKey> parse_replay_key(const std::filesystem::path& file, std::string_view text,
                                   const std::vector<std::string>& more_kinds = {});

}  // namespace palpate::scenes
