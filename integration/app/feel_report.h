#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "integration/charts/timeline.h"
#include "integration/running/connected_session.h"
#include "integration/web/https_server.h"

namespace palpate::app {

using running::CauseTime;
using running::FeelNumbers;
using running::TickRow;

/// What can be said of a scene before anything is felt, volume by volume. live: its frames come
/// from a live source.
std::vector<std::string> scene_lines(const LoadedScene& scene, bool live);

/// "Segment   pool, colour 0.9 0.3 0.3: a wall of 4 N, 4000 N/m; at 0.5 of its size a tenth of it
/// is at most 1.4 mm thick and holds 1.1 N". volume: the one that it is a segment of.
std::string segment_text(const Segment& segment, const VolumeSpec& volume);

/// "coarse motion, 1 s left", then "refining: motion 3 of 20 steps, 25 s left"; nothing once it is
/// done.
std::string motion_text(const LiveMotion& motion);

/// What the hand does, or why its force is not the scene's: "touching", "free", "starting", ...
const char* state_text(const TickOutput& tick);

/// The live line of a tick: "1.23 N at 1000 Hz, phase 2.31, touching".
std::string live_text(const TickOutput& tick, const ServoStatistics& statistics, double seconds);

/// The summary for the user, in lines with a newline at each end.
std::string summary_text(const FeelNumbers& numbers, const ServoStatistics& statistics,
                         const ServoReport& report, const EnergyLedger& energy);

/// "Tubes     3 stream tubes, 2 of them kept".
std::string tubes_text(const ReleasedTubes& tubes);

/// How evenly the servo thread ran.
std::string periods_text(const ServoStatistics& statistics);

/// What a server sends, once clients may connect, and what it has sent at the end: for programs,
/// see docs/openigtlink.md. page: null if there is none.
nlohmann::json serving_json(const running::ConnectedSession& run, const web::HttpsServer* page);
nlohmann::json served_json(const running::ConnectedSession& run);

/// Force, depth and phase over time, with title and subtitle.
charts::Timeline feel_timeline(const std::string& title, const FeelNumbers& numbers,
                               const std::vector<TickRow>& rows);

/// The same as PNG. Errors: kBadInput if there are no ticks, kBadOutput.
Status write_feel_picture(const std::string& path, const std::string& title,
                          const FeelNumbers& numbers, const std::vector<TickRow>& rows);

}  // namespace palpate::app
