#pragma once

#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "integration/app/tick_log.h"
#include "integration/charts/timeline.h"
#include "module/haptics/energy.h"
#include "module/haptics/servo.h"

namespace palpate::app {

/// A cause that was at work, and for how long.
struct CauseTime {
  Cause cause = Cause::kNone;
  DeviceFault fault = DeviceFault::kNone;
  double seconds = 0.0;
  double from_s = 0.0;  ///< first
};

/// What a run was, in numbers, from its ticks.
struct FeelNumbers {
  double seconds = 0.0, touched_s = 0.0;
  double most_force_n = 0.0, mean_force_n = 0.0;  ///< while touched
  double deepest_m = 0.0;          ///< the hand behind the surface, as the spring is stretched
  double steepest_n_per_ms = 0.0;  ///< greatest change of the force that reached the hand
  double worst_residual_m = 0.0;
  int most_newton_steps = 0;
  uint64_t held = 0;              ///< ticks whose motion could not be turned around
  std::vector<CauseTime> causes;  ///< other than none, longest first
};
FeelNumbers numbers_of(const std::vector<TickRow>& rows);

/// "1.23 N at 1000 Hz, phase 2.31, touching": what the live line says of a tick.
std::string live_text(const TickOutput& tick, const ServoStatistics& statistics, double seconds);

/// The summary for a person, lines with a newline at each end.
std::string summary_text(const FeelNumbers& numbers, const ServoStatistics& statistics,
                         const ServoReport& report, const EnergyLedger& energy);

/// Force, depth and phase over time; title and subtitle say what.
charts::Timeline feel_timeline(const std::string& title, const std::vector<TickRow>& rows);

/// The same as PNG. kBadInput if nothing was felt, kBadOutput.
Status write_feel_picture(const std::string& path, const std::string& title,
                          const std::vector<TickRow>& rows);

}  // namespace palpate::app
