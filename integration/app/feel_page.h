#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "integration/running/connected_session.h"
#include "module/scene/moving_volume.h"

namespace palpate::app {

/// Writes a page for browsers of what was felt: the volume as it moved at the times of its frames,
/// how far its material was from the carried frame. Also its segments and their volumes
/// over the cycle, the force and the depth over the run, and the summary's lines. A volume without
/// samples (formulas) gives curves and numbers only. Uses all cores. kBadOutput as
/// web::check_can_write_page().
Status write_feel_page(const std::filesystem::path& path, const std::string& title,
                       const MovingVolume& volume, const running::FeelNumbers& numbers,
                       const std::vector<running::TickRow>& rows, const std::string& summary);

}  // namespace palpate::app
