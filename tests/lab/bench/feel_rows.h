#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "module/haptics/delay_lead.h"
#include "tests/lab/bench/tools.h"

namespace palpate::bench {

/// How much is measured.
struct FeelBench {
  bool quick = false;                     ///< a fortieth of everything: does it work?
  unsigned threads = 1;                   ///< for what is not timed
  int64_t frames = 0;                     ///< haptic frames of the search for pop-through
  int stability_runs = 0;                 ///< runs of each row of limit cycles
  double lead_share = DelayLead::kShare;  ///< of the delay that the lead takes back there
  /// So much of a full run.
  int64_t part(int64_t full) const { return quick ? (full + 39) / 40 : full; }
};

/// A row of the table of goals. Smaller is better; reach and aim are the most that may be.
struct Goal {
  std::string what;
  std::string others;  ///< what the paper or others have
  std::string unit;
  std::optional<double> reach, aim;
  double measured = 0.0;
  int digits = 2;      ///< after the point, of what was measured
  std::string beside;  ///< the baseline of the same run, conditions
};

/// What a family of rows found: its part of the table of goals, and tables of its own.
struct Findings {
  std::vector<Goal> goals;
  std::vector<Table> details;
};

/// Time of one haptic frame, and the servo thread at 1 kHz. Runs one thread at a real-time priority
/// where the system allows it.
Findings time_rows(const FeelBench& bench);
/// Force against exact solutions: still and beating, data as formulas and sampled.
Findings force_rows(const FeelBench& bench);
/// How often a hand gets through a thin wall without being stronger than it.
Findings dart_rows(const FeelBench& bench);
/// Inverting the motion: residual and steps, folds, drift.
Findings back_track_rows(const FeelBench& bench);
/// Ticks at the ends of graphics frames.
Findings frame_end_rows(const FeelBench& bench);
/// Limit cycles, and energy that a scene makes.
Findings stability_rows(const FeelBench& bench);

}  // namespace palpate::bench
