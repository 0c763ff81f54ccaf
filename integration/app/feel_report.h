#pragma once

#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "integration/charts/timeline.h"
#include "integration/headset/headset_event.h"
#include "integration/sessions/feel_numbers.h"
#include "module/haptics/energy.h"
#include "module/haptics/servo.h"

namespace palpate::app {

using sessions::CauseTime;
using sessions::FeelNumbers;
using sessions::TickRow;

/// "1.23 N at 1000 Hz, phase 2.31, touching": what the live line says of a tick.
std::string live_text(const TickOutput& tick, const ServoStatistics& statistics, double seconds);

/// The summary for a person, lines with a newline at each end.
std::string summary_text(const FeelNumbers& numbers, const ServoStatistics& statistics,
                         const ServoReport& report, const EnergyLedger& energy);

/// The event's sentence with what the program's own commands and options can do about it.
std::string advised(const headset::HeadsetEvent& event);

/// Force, depth and phase over time; title and subtitle say what.
charts::Timeline feel_timeline(const std::string& title, const FeelNumbers& numbers,
                               const std::vector<TickRow>& rows);

/// The same as PNG. kBadInput if nothing was felt, kBadOutput.
Status write_feel_picture(const std::string& path, const std::string& title,
                          const FeelNumbers& numbers, const std::vector<TickRow>& rows);

}  // namespace palpate::app
