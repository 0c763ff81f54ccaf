#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "module/haptics/proxy/delay_lead.h"
#include "tests/lab/bench/tools.h"

namespace palpate::bench {

/// How much is measured.
struct FeelBench {
  /// A fortieth of everything: a test that the benchmark works.
  bool quick = false;
  /// For measurements that are not timed.
  unsigned threads = 1;
  int64_t frames = 0;      ///< haptic frames of the search for pop-through
  int stability_runs = 0;  ///< runs of each row of limit cycles
  /// The share of the delay that the lead compensates there.
  double lead_share = DelayLead::kShare;
  /// The amount for this run, from that of a full run.
  int64_t part(int64_t full) const { return quick ? (full + 39) / 40 : full; }
};

/// A row of the table of goals. Smaller is better; reach and aim are upper limits.
struct Goal {
  std::string what;
  /// The values of the paper or of others.
  std::string others;
  std::string unit;
  std::optional<double> reach, aim;
  double measured = 0.0;
  /// Decimals of the measured value.
  int digits = 2;
  /// The baseline of the same run, and conditions.
  std::string beside;
};

/// The result of a family of rows: its part of the table of goals, and tables of its own.
struct Findings {
  std::vector<Goal> goals;
  std::vector<Table> details;
};

/// Time of one haptic frame, and the servo thread at 1 kHz. Runs one thread at a real-time priority
/// if the system allows it.
Findings time_rows(const FeelBench& bench);
/// Force compared with exact solutions: still and beating, data as formulas and sampled.
Findings force_rows(const FeelBench& bench);
/// How often a hand passes through a thin wall with a force below the wall's strength.
Findings dart_rows(const FeelBench& bench);
/// Inverting the motion: residual and steps, folds, drift.
Findings back_track_rows(const FeelBench& bench);
/// Force ticks at the ends of graphics frames.
Findings frame_end_rows(const FeelBench& bench);
/// Limit cycles, and energy that a scene generates.
Findings stability_rows(const FeelBench& bench);

}  // namespace palpate::bench
