#pragma once

#include <filesystem>
#include <string>

#include "integration/loading/load_scene.h"
#include "module/haptics/servo/recording.h"
#include "module/session/hand_tubes.h"

namespace palpate::running {

/// Runs a recording again with the scene as it is loaded now. `tubes` gets the stream tubes that
/// the user released in it. Errors: kBadInput if it was made with another scene, is damaged, or
/// lost ticks.
Result<Replay> replay_felt(const LoadedScene& scene, const std::filesystem::path& file,
                           HandTubes& tubes);

/// "every output is the recorded one, bit by bit", or where it differs.
std::string replay_text(const Replay& replay);

}  // namespace palpate::running
