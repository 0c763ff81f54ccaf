#pragma once

#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "integration/charts/timeline.h"
#include "integration/sessions/feel_numbers.h"
#include "module/haptics/energy.h"
#include "module/haptics/servo.h"

namespace palpate::app {

using sessions::CauseTime;
using sessions::FeelNumbers;
using sessions::TickRow;

/// The live line of a tick: "1.23 N at 1000 Hz, phase 2.31, touching".
std::string live_text(const TickOutput& tick, const ServoStatistics& statistics, double seconds);

/// The summary for the user, in lines with a newline at each end.
std::string summary_text(const FeelNumbers& numbers, const ServoStatistics& statistics,
                         const ServoReport& report, const EnergyLedger& energy);

/// Force, depth and phase over time, with title and subtitle.
charts::Timeline feel_timeline(const std::string& title, const FeelNumbers& numbers,
                               const std::vector<TickRow>& rows);

/// The same as PNG. Errors: kBadInput if there are no ticks, kBadOutput.
Status write_feel_picture(const std::string& path, const std::string& title,
                          const FeelNumbers& numbers, const std::vector<TickRow>& rows);

}  // namespace palpate::app
